"""Free labels: participants give words, the experimenter sorts them afterwards, and the sorts are counted."""

from made_studies import made_protocol, preset_protocol

from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.simulation import simulated_rows
from underfoot.experiments.study import Study
from underfoot.experiments.trial_files import write_csv
from underfoot.studies.results import analysed_elsewhere


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


def test_a_table_of_the_chosen_study_is_analysed_by_its_protocol_and_another_is_not(tmp_path):
    """In the window, the share of the thesis's labels was of the sort that came first in the table: no impact."""
    protocol, path = preset_protocol("free-labels"), tmp_path / "sorted.csv"
    rows = simulated_rows(protocol, 0, 1, {})[0]
    of_study = "Analysed as trials of the study Free labels for 16 stimuli, which has their stages and stimuli."
    for stimulus, sort, told in (("WS1", "impact", [of_study]), ("mine", "no impact", [])):
        done = [{**row, "sort": row["label"]} for row in rows]
        write_csv(path, [{**done[0], "sort": "no impact", "stimulus": stimulus}, *done[1:]])
        (found, *_) = analysed_elsewhere([path], Settings(), protocol)
        assert [row[1].removesuffix(" IT") for row in found.tables[1].rows[:1]] == [sort]
        assert found.remarks == told
