"""Free labels: participants give words, the experimenter sorts them afterwards, and the sorts are counted."""

from made_studies import made_protocol

from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.study import Study


def test_who_labels_does_not_see_the_sorts_and_what_the_experimenter_sorts_is_counted():
    """The page asked "impact or no impact?" below the words: whoever had seen it named impacts from then on."""
    protocol = made_protocol("free-labels", {"sorts": "Impact, no impact"})
    assert [question.name for question in Study(protocol, "P1").page.questions] == ["label"]
    rows = [
        {"participant": "P1", "stage": "main", "method": "free-labels", "trial": k, "stimulus": "TD", "set": "IT"}
        | ({"label": label} if label else {})
        for k, label in enumerate(("Knock", "", "knock", "hum"), 1)
    ]
    (unsorted,) = analysed(rows, protocol, Settings())
    assert [table.rows for table in unsorted.tables] == [(("TD", "knock (2), (no words), hum"),)]
    why = "are not sorted, and in no share: fill in a column sort of the table of trials with Impact or no impact, and"
    assert unsorted.remarks == [f"Of 4 labels, 4 {why} analyse that."]
    sorts = ("impact", "impcat", "Impact ", "no impact")  # as typed by hand: the second, in no share, is told
    done = [row | ({"sort": sort} if sort else {}) for row, sort in zip(rows, sorts, strict=True)]
    own_words = {**rows[0], "trial": 5, "label": "No impact"}  # needs no sorting
    (found,) = analysed([*done, own_words], protocol, Settings())
    (share,) = found.tables[1].rows
    assert share[1:3] == ("Impact IT", 0.5)
    assert found.remarks == [f"Of 5 labels, 1 {why} analyse that."]
