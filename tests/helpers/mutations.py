"""Damaged files: bytes changed, and JSON values replaced by others that JSON allows."""

import json

JUNK = (None, True, -1, 0, 1e308, -1e308, 10**30, 0.5, "", "x" * 100, "\ud800", [], {}, [[]], {"a": 1}, [0.0] * 3)
TEXTS = ("NaN", "Infinity", "-Infinity", "1e999", "[" * 300 + "]" * 300, '{"a":' * 300 + "1" + "}" * 300)


def mutated(data, rng):
    """Return the bytes of a file, mutated; `rng` is a `random.Random`."""
    kind = rng.randrange(4)
    if kind == 0:
        data = bytearray(data)
        for _ in range(rng.choice((1, 1, 2, 8, 64))):
            data[rng.randrange(len(data))] = rng.randrange(256)
        return bytes(data)
    if kind == 1:
        return data[: rng.randrange(len(data))]
    if kind == 2:
        first, last = sorted((rng.randrange(len(data)), rng.randrange(len(data))))
        return data[:first] + data[last:] if rng.random() < 0.5 else data[:last] + data[first:]
    return with_junk(data, rng)


def with_junk(data, rng):
    """Return a JSON document with one to four of its values, keys or items replaced; other bytes unchanged."""
    start = data.find(b"{")
    try:
        raw = json.loads(data[max(start, 0) :])
    except ValueError:
        return data[: len(data) // 2]
    for _ in range(rng.choice((1, 1, 2, 4))):
        raw = _replaced(raw, rng)
    text = json.dumps(raw)
    if rng.random() < 0.2:
        at = [i for i, sign in enumerate(text) if sign in "0123456789"]
        if at:
            place = rng.choice(at)
            text = text[:place] + rng.choice(TEXTS) + text[place + 1 :]
    return data[: max(start, 0)] + text.encode("utf-8", "surrogatepass")


def _replaced(value, rng):
    inside = isinstance(value, dict | list) and len(value) > 0 and rng.random() < 0.9
    if not inside:
        if isinstance(value, int | float) and rng.random() < 0.5:
            return value * rng.choice((-1, 0, 1e-6, 1e6, 1e300))
        return rng.choice(JUNK)
    keys = list(value) if isinstance(value, dict) else list(range(len(value)))
    key = rng.choice(keys)
    if rng.random() < 0.1:
        if isinstance(value, dict):
            return {other: item for other, item in value.items() if other != key}
        return [*value[: int(key)], *value[int(key) :] * 2]
    if isinstance(value, dict):
        return {other: _replaced(item, rng) if other == key else item for other, item in value.items()}
    return [_replaced(item, rng) if other == key else item for other, item in enumerate(value)]


def mutated_document(document, rng, keys, values):
    """Return a JSON document with one to three changes: a value replaced, a key removed or added, an item doubled.

    `keys` and `values` are those that are put in.
    """
    changed = json.loads(json.dumps(document))
    for _ in range(rng.randint(1, 3)):
        places, queue = [], [changed]
        while queue:
            here = queue.pop()
            for key in here if isinstance(here, dict) else range(len(here)):
                places.append((here, key))
                if isinstance(here[key], dict | list):
                    queue.append(here[key])
        where, key = rng.choice(places)
        match rng.randint(0, 3):
            case 0:
                del where[key]
            case 1 if isinstance(where, list):
                where.append(where[key])
            case 2 if isinstance(where, dict):
                where[rng.choice(keys)] = rng.choice(values)
            case _:
                where[key] = rng.choice(values)
    return changed
