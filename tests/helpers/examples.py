"""Which modules are searched for examples; in a plugin, as the hooks of a `conftest` see its own folder only."""


def pytest_ignore_collect(collection_path):
    """Modules without an example are passed over: each process of the tests would import and search them all."""
    if collection_path.suffix == ".py" and "as-installed" in collection_path.parts:
        return b">>>" not in collection_path.read_bytes() or None
    return None
