"""The trials of sessions and tables: import for the analysis, and export to other programs."""

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from underfoot.errors import BadFile, BadMeasurement, BadValue, UnderfootError
from underfoot.experiments.analysis.analyses import analysed, estimates_of_people
from underfoot.experiments.analysis.findings import Findings, Table
from underfoot.experiments.analysis.report import write_page
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.columns import FORCE_FROM
from underfoot.experiments.physio import write_physio
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.store import SessionFile
from underfoot.experiments.study import Entry, Study, is_over
from underfoot.experiments.table import (
    OF_PERSON,
    Row,
    alike_ids,
    as_left_out,
    rows_of,
    why_left_out,
    with_levels,
)
from underfoot.experiments.table import counted as those_that_count
from underfoot.experiments.trial_files import columns_of_study, described_columns, read_csv, write_bids, write_csv
from underfoot.experiments.trials import NOTHING
from underfoot.quantities import counted
from underfoot.records.recording import is_recording
from underfoot.studies.set_up import COLUMNS

FORMS = ("CSV", "estimates", "BIDS", "report")
"""Forms in which trials of sessions, and what came of them, can be written."""
SUFFIX = ".session"
"""The suffix of a session; a damaged one is told as such, and not as a bad table."""


@dataclass(frozen=True)
class Results:
    """All trials of some files, the protocol that the sessions among them share, and those sessions.

    `left_out` names sessions of another version of the protocol, and `reworded` those that differ in words, preferred
    foot or blinding alone, which count; `unfinished` those that lack answers, and count as far as they go; `set_ups`
    say whose each is, when it was begun, and with what it was made; `notes` are those of the experimenter: participant,
    time, number of the entry before, text. `excluded` are the participants whom the experimenter has left out, with
    why; their rows are spoiled. `unread` says of damaged sessions what is wrong.
    """

    title: str
    rows: tuple[Row, ...]
    protocol: Protocol | None
    sessions: tuple[Path, ...]
    left_out: tuple[str, ...] = ()
    reworded: tuple[str, ...] = ()
    unfinished: tuple[str, ...] = ()
    set_ups: tuple[tuple[str, ...], ...] = ()
    notes: tuple[tuple[str, str, int, str], ...] = ()
    excluded: tuple[tuple[str, str], ...] = ()
    unread: tuple[str, ...] = ()

    @property
    def _excluded_text(self) -> str:
        """Who is left out, and why, in a line."""
        return ", ".join(f"{person} ({why})" for person, why in self.excluded)

    @property
    def _without_hardware(self) -> Sequence[str]:
        """Who has trials that count, in which nobody's force was measured."""
        found = (str(row["participant"]) for row in those_that_count(self.rows) if row.get(FORCE_FROM))
        return list(dict.fromkeys(found))

    @property
    def remarks(self) -> list[str]:
        """What the user should know about these trials, a line each."""
        found = [f"Cannot be read, and does not count: {why}." for why in self.unread]
        for how, labels in (
            ("Begun with another version of the protocol, left out", self.left_out),
            ("Begun with other titles, texts or words of questions, blinding, or foot, and counted", self.reworded),
            ("Not finished, and counted as far as they go", self.unfinished),
            ("With simulated or replayed forces, in all trials or some, and counted", self._without_hardware),
        ):
            if labels:
                found.append(f"{how}: {', '.join(labels)}.")
        if self.excluded:
            found.append(f"Left out by the experimenter: {self._excluded_text}.")
        for ids in alike_ids(self.rows):
            found.append(f"{' and '.join(ids)} differ in letter case only, and are counted as {len(ids)} participants.")
        return found

    def findings(self, settings: Settings) -> list[Findings]:
        """Analyse the trials; what the experimenter noted comes last. Raises `BadMeasurement` if none is left."""
        if self.left_out and not self.rows:
            remarks = " ".join(self.remarks)
            raise BadMeasurement(f"{remarks} Analyse these files without the protocol: they hold theirs.")
        rows = [row for row in self.rows if not why_left_out(row)]
        if self.excluded and not rows:
            raise BadMeasurement(f"nobody else has answered a trial than who is left out: {self._excluded_text}")
        found = analysed(rows, self.protocol, settings)
        found[0].remarks += self.remarks
        if self.notes:
            told = (
                "Entries are numbered as in the table of trials. Stops, answers taken back, calibrations in use with "
                "day and digest, and another set-up than before, are noted by the program."
            )
            columns = ("participant", "time", "after entry", "note")
            found.append(Findings("What was noted", [Table("Notes of the sessions", columns, self.notes, told)]))
        return found

    def write_csv(self, path: Path) -> None:
        """Write all trials, one per row."""
        write_csv(path, self.rows, columns_of_study(self.rows, self.protocol))

    def write_estimates(self, path: Path, settings: Settings) -> None:
        """Write what each person was asked, and their estimates, one person per row."""
        people = estimates_of_people(self.rows, self.protocol, settings)
        names = dict.fromkeys(name for row in people for name in row)
        asked = [name for name in names if name.startswith(OF_PERSON)]
        write_csv(path, people, list(dict.fromkeys(["participant", *asked, *names])))

    def write_bids(self, folder: Path) -> list[str]:
        """Write a BIDS data set: behavioural files, and force and vibration of each trial of the sessions.

        Return what could not be read of force and vibration, a line for each session concerned.
        """
        unread = []
        write_bids(folder, self.rows, self.title, self.protocol)
        people = {row["participant"] for row in self.rows if not why_left_out(row)}
        for path in self.sessions:
            with closing(SessionFile.open(path)) as file:
                if file.left_out and file.counts_as in people:  # of whom another session counts
                    continue
                if why := write_physio(folder, file, self.title):
                    entries, first = ", ".join(map(str, why)), next(iter(why.values()))
                    unread.append(f"Written without force and vibration of entry {entries}: {first}.")
        return unread

    def write_report(self, folder: Path, findings: Sequence[Findings]) -> None:
        """Write a page with these findings, how they were measured, and what the columns are: `analysis.html`."""
        people = dict.fromkeys(str(row["participant"]) for row in self.rows if not why_left_out(row))
        left_out = [("left out", self._excluded_text)] if self.excluded else []
        write_page(
            folder / "analysis.html",
            self.title,
            [*findings, self._measured()],
            [("participants", f"{len(people)}: {', '.join(people)}"), *left_out],
        )

    def _measured(self) -> Findings:
        """Return what a reader of the report asks of the sessions, and of the table of trials."""
        described = described_columns(self.rows, self.protocol)
        tables = [Table("Columns of the table of trials", ("column", "what it holds"), described)]
        if self.protocol is not None and self.set_ups:
            told = f"Orders follow from the protocol's seed, {self.protocol.seed}, and the id that each was begun with."
            tables.insert(0, Table("Sessions", ("participant", "begun", *COLUMNS), self.set_ups, told))
        return Findings("How it was measured", tables)


def results_of(paths: Sequence[Path], protocol: Protocol | None = None) -> Results:
    """Return the trials of one or more files: sessions, and CSVs of trials.

    With a `protocol`, sessions of another version are left out. Without, raises `BadValue` if sessions differ in
    protocol, in more than its words. Raises `BadValue` also if two sessions that count are of one participant, or two
    files contain the same trial, and both count. A damaged session is named, and the others count; raises its error if
    there are none.
    """
    rows, that_count, whose = list[Row](), set[tuple[object, ...]](), dict[str, Path]()
    read, excluded, unread = list[_Session](), dict[tuple[str, str], None](), list[UnderfootError]()
    shared, text = protocol, "" if protocol is None else protocol.dumps().decode()
    for path in paths:
        if path.suffix != SUFFIX and not is_recording(path):
            table = read_csv(path)
            excluded |= dict.fromkeys((str(row["participant"]), why) for row in table if (why := why_left_out(row)))
            rows += _required_new(path, table if protocol is None else with_levels(table, protocol), that_count)
            continue
        try:
            one = _session(path, shared, text)
        except UnderfootError as error:
            if not path.exists():  # a name that was typed wrong is no damaged session
                raise
            unread.append(error)
            continue
        read.append(one)
        if not one.is_of_study:
            if protocol is None:
                other = f"{path} is of another protocol than {read[0].path}"
                raise BadValue(f"{other}; analyse them one by one, or write a CSV of each, and analyse these")
            continue
        shared, text = one.protocol, text or one.text
        if one.left_out:
            excluded[one.participant, one.left_out] = None
        elif one.rows and (before := whose.setdefault(one.participant, path)) != path:
            what = f"{path} is {one.participant}'s session, and so is {before}"  # they may have no trial in common
            raise BadValue(f"{what}; analyse one of them, leave one out, or correct an id")
        rows += _required_new(path, one.rows, that_count)
    if unread and not (rows or read):
        raise unread[0]
    of_study = [one for one in read if one.is_of_study]
    return Results(
        shared.title if shared is not None else paths[0].stem,
        tuple(_without_doubles(rows, that_count)),
        shared,
        sessions=tuple(one.path for one in of_study),
        left_out=tuple(one.label for one in read if not one.is_of_study),
        reworded=tuple(one.label for one in of_study if one.text != text),
        unfinished=tuple(one.label for one in of_study if one.is_unfinished and not one.left_out),
        set_ups=tuple((one.label, *one.set_up) for one in of_study),
        notes=tuple(note for one in of_study for note in one.notes),
        excluded=tuple(excluded),
        unread=tuple(map(str, unread)),
    )


def analysed_files(paths: Sequence[Path], settings: Settings, protocol: Protocol | None) -> list[Findings]:
    """Return the findings of sessions and tables of trials.

    Sessions of another version of `protocol` are left out, and listed in a remark.
    """
    return results_of(paths, protocol).findings(settings)


def analysed_elsewhere(paths: Sequence[Path], settings: Settings, protocol: Protocol) -> list[Findings]:
    """Return the findings of files that are not a study's own: of sessions by the protocol that they hold.

    Tables do not hold theirs: it is `protocol`, and a remark says so, if it has their stages, methods and stimuli.
    """
    results = results_of(paths)
    if results.protocol is not None or not _is_of(protocol, results.rows):
        return results.findings(settings)
    findings = analysed_files(paths, settings, protocol)
    findings[0].remarks.append(f"Analysed as trials of the study {protocol.title}, which has their stages and stimuli.")
    return findings


def _is_of(protocol: Protocol, rows: Sequence[Row]) -> bool:
    """Return whether trials have stages, methods and stimuli of a protocol only."""
    stages = {(stage.id, stage.method.kind) for stage in protocol.stages if stage.method is not None}
    stimuli = {None, NOTHING, *protocol.stimuli}
    return all((row["stage"], row["method"]) in stages and row.get("stimulus") in stimuli for row in rows)


def written_files(
    paths: Sequence[Path], form: str, where: Path, settings: Settings, protocol: Protocol
) -> list[Findings]:
    """Write the trials of sessions as one of `FORMS` to a file or folder; return a remark that confirms it."""
    results, unread = results_of(paths, protocol), list[str]()
    match form:
        case "CSV":
            results.write_csv(where)
        case "estimates":
            results.write_estimates(where, settings)
        case "BIDS":
            unread = results.write_bids(where)
        case _:
            results.write_report(where, results.findings(settings))
    people = len({row["participant"] for row in results.rows})
    trials = counted(len(results.rows), "trial")
    text = f"{form[0].upper()}{form[1:]} of {trials}, participants: {people}. It is in {where}"
    return [Findings("Written", remarks=[text, *unread, *results.remarks])]


def has_all_answers(protocol: Protocol, participant: str, entries: Sequence[Entry]) -> bool:
    """Return whether a session has all answers, or it cannot be known: a package or an earlier version is needed."""
    try:
        return is_over(protocol, participant, entries) or Study(protocol, participant, entries).has_all_answers
    except UnderfootError:
        return True


@dataclass(frozen=True)
class _Session:
    """What the analysis needs of a session, read as a whole: a damaged one is not to count in part."""

    path: Path
    protocol: Protocol
    text: str
    """The protocol as the file has it."""
    is_of_study: bool
    participant: str
    label: str
    left_out: str
    rows: Sequence[Row]
    is_unfinished: bool
    set_up: Sequence[str]
    notes: Sequence[tuple[str, str, int, str]]


def _session(path: Path, shared: Protocol | None, text: str) -> _Session:
    """Return what a file has of the study of `shared`, whose `text` is given; without one, of its own."""
    with closing(SessionFile.open(path)) as file:
        known, begun_as, entries = file.about["protocol"], file.participant, file.entries()
        participant, left_out = file.counts_as, file.left_out
        of = file.stored_protocol() if shared is None else shared
        is_of_study = shared is None or known == text or _differs_in_words(file, shared)
        rows: Sequence[Row] = rows_of(of, begun_as, entries) if is_of_study else []
        rows = [{**row, "participant": participant} for row in rows]
        lacks_answers = bool(rows) and not has_all_answers(of, begun_as, entries)
        if left_out:
            rows = as_left_out(rows, left_out)
        notes = [(participant, one.at[:19].replace("T", " "), one.entry, one.text) for one in file.notes()]
        about, whose = file.about, (participant, file.label, left_out)
        set_up = (about.get("begun", "")[:19].replace("T", " "), *(about.get(name, "") for name in COLUMNS))
        return _Session(path, of, known, is_of_study, *whose, rows, lacks_answers, set_up, notes)


def _differs_in_words(file: SessionFile, protocol: Protocol) -> bool:
    """Return whether the session was begun with this protocol, except for what changes no row of a trial."""
    try:
        return file.stored_protocol().without_words().dumps() == protocol.without_words().dumps()
    except BadFile:  # of a version that had other fields
        return False


def _required_new(path: Path, rows: Sequence[Row], known: set[tuple[object, ...]]) -> Sequence[Row]:
    """Return the rows of a file, and add those that count to what is `known` of the files before it.

    Raises `BadValue` if one of them has one of these trials, too. A trial of the same number and another stimulus is of
    another study, in which the same person took part.
    """
    counted_rows = [row for row in rows if not why_left_out(row)]
    for row in counted_rows:
        if _trial(row) in known:
            text = f"{row['participant']}'s trial {row['trial']} of {row['stage']} is in a file before it, too"
            raise BadValue(f"{path}: {text}; analyse one of them, leave one out, or correct an id")
    known.update(map(_trial, counted_rows))
    return rows


def _without_doubles(rows: Sequence[Row], that_count: set[tuple[object, ...]]) -> list[Row]:
    """Return the rows without those of a session that is left out where another of that id has the same trials."""
    doubled = {row["participant"] for row in rows if why_left_out(row) and _trial(row) in that_count}
    return [row for row in rows if not why_left_out(row) or row["participant"] not in doubled]


def _trial(row: Row) -> tuple[object, ...]:
    """Return what a trial is known by in all files."""
    return tuple(row.get(column, 1) for column in ("participant", "stage", "block", "trial", "attempt", "stimulus"))
