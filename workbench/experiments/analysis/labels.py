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
        given = Counter(_label(row) or "(no words)" for row in part)
        words.append((str(name), ", ".join(f"{word} ({n})" if n > 1 else word for word, n in given.most_common())))
    found.tables.append(Table("Labels", ("stimulus", "labels"), tuple(words)))
    sorts = _sorts(rows, settings)
    if not any(_sort(row) in sorts for row in rows):
        found.remarks.append("No label was sorted yet: add a column sort to the table of trials, and analyse that.")
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
    return shares_by_person((row for row in rows if _sort(row) in sorts), lambda row: _sort(row) == sorts[0])


def _label(row: Row) -> str:
    return str(row.get("label", "")).strip().lower()


def _sort(row: Row) -> str:
    """Return what a label was sorted into; one that is a sort's own word needs no sorting."""
    return str(row.get("sort") or _label(row))


def _sorts(rows: Sequence[Row], settings: Settings) -> list[str]:
    """Return the sorts, in the order of the protocol, or as found in the table."""
    used = dict.fromkeys(str(row["sort"]) for row in rows if row.get("sort"))
    return sorts_of(settings.given) or list(used)
