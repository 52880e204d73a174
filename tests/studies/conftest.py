"""A session on which studies run."""

import pytest
from people import open_session


@pytest.fixture(scope="module")
def session(until):
    with open_session(until) as opened:
        yield opened
