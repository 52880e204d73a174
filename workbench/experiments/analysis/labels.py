"""Free labels: the words, and the frequency of each sort of label in each set (thesis 3.4.2)."""

from collections import Counter
from collections.abc import Sequence

from underfoot.experiments.analysis import thesis
from underfoot.experiments.analysis.comparisons import shares_compared
from underfoot.experiments.analysis.estimate import PEOPLE_NOTE, Estimate, people_share_interval
from underfoot.experiments.analysis.findings import Findings, Table, estimates_table
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.methods.free_labels import sorts_of
from underfoot.experiments.table import Row, grouped, shares_by_person


def estimates(rows: Sequence[Row], settings: Settings) -> list[Estimate]:
    """Estimate the share of the first sort among the sorted labels of each set, for one person or all."""
    sorts = _sorts(rows, settings)
    found = []
    for (name,), part in sorted(grouped(rows, "set").items()):
        if sorts:
            shares = _sorted_by_person(part, sorts)
            found.append(people_share_interval(f"{sorts[0]} {name}".rstrip(), shares.values()))
    return found


def findings(rows: Sequence[Row], settings: Settings) -> Findings:
    """Report over people: labels of each stimulus, shares of sorts, and a test between two sets."""
    found = Findings("Free labels")
    words = []
    for (name,), part in sorted(grouped(rows, "stimulus").items()):
        given = Counter(_plain(row.get("label", "")) or "(no words)" for row in part)
        words.append((str(name), ", ".join(f"{word} ({n})" if n > 1 else word for word, n in given.most_common())))
    found.tables.append(Table("Labels", ("stimulus", "labels"), tuple(words)))
    sorts = _sorts(rows, settings)
    if left := sum(_sort(row, sorts) is None for row in rows):
        words_of = f" with {' or '.join(sorts)}" if sorts else ""
        found.remarks.append(
            f"Of {len(rows)} labels, {left} are not sorted, and in no share: fill in a column sort of the table of "
            f"trials{words_of}, and analyse that."
        )
    if left == len(rows):
        return found
    sets = sorted(grouped(rows, "set").items())
    note = f"{PEOPLE_NOTE} {_THESIS if any(name in thesis.SETS for (name,), _ in sets) else ''}".rstrip()
    found.tables.append(
        estimates_table("Sorts", "of", [("all people", estimate) for estimate in estimates(rows, settings)], note)
    )
    if len(sets) == 2 and len(sorts) == 2:
        shares = {str(name): _sorted_by_person(part, sorts) for (name,), part in sets}
        found.add_tests("Do the sets differ?", lambda: shares_compared("set by sort", shares))
    return found


_THESIS = (
    f"Thesis 3.4.2, labels that name an impact: {', '.join(f'{k} {v:.0%}' for k, v in thesis.IMPACT_LABELS.items())}."
)


def _sorted_by_person(rows: Sequence[Row], sorts: Sequence[str]) -> dict[str, tuple[int, int]]:
    """Return how many labels of each person are of the first sort, and how many were sorted."""
    return shares_by_person((row for row in rows if _sort(row, sorts)), lambda row: _sort(row, sorts) == sorts[0])


def _sort(row: Row, sorts: Sequence[str]) -> str | None:
    """Return what a label was sorted into, None if into none of these; one that is a sort's own word is sorted."""
    word = _plain(row.get("sort") or row.get("label", ""))
    return next((sort for sort in sorts if _plain(sort) == word), None)


def _sorts(rows: Sequence[Row], settings: Settings) -> list[str]:
    """Return the sorts, in the order of the protocol, or as found in the table."""
    return sorts_of(settings.given) or list(dict.fromkeys(_plain(row["sort"]) for row in rows if row.get("sort")))


def _plain(words: object) -> str:
    """Return words by which a label is told from others, and a sort: letter case and spaces around are typed so or so.

    >>> _plain(" Impact")
    'impact'
    """
    return str(words).strip().lower()
