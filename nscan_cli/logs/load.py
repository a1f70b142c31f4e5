"""A log by its path: the bytes, unpacked, and the reader that knows their form."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from mmap import mmap
from typing import Protocol

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.files.encoding import without_byte_order_mark
from nscan_cli.files.inputs import FileBytes, base_name, common_hash, label, memory_map, read_bytes, sha256_of
from nscan_cli.files.limits import LimitExceededError
from nscan_cli.files.source import Source
from nscan_cli.logs.compression import compression_of, decompressed
from nscan_cli.logs.formats import FORMS, Form, foreign_kind, readable_forms
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.log_files import Parts, first_bytes, journals_of, parts_of
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.recordings import split_recordings
from nscan_cli.logs.recordings.container import DAMAGE_REMEDY, Recording


class Reader(Protocol):
    """What a module that reads a form of log has."""

    def read(self, data: bytes, file: str, source: Source, options: ReadingOptions) -> LaserLog:
        """The scans; `file` is what messages call it. Raises InputDataError and WrongUsageError."""


class Container(Protocol):
    """What a module that reads a container of messages has."""

    def read_recording(self, data: FileBytes, file: str, salvage: bool) -> Recording:
        """The messages; `file` is what errors call it. Raises InputDataError and LimitExceededError."""


class Database(Container, Protocol):
    """What a module has that opens a file itself."""

    def read_recording_file(
        self, path: str, journals: Mapping[str, str], file: str, salvage: bool
    ) -> Recording:
        """The messages in the file and in what parts.beside has found. Raises the same errors."""


DEFAULT_READING = ReadingOptions()


def read_log(
    paths: str | Sequence[str], options: ReadingOptions = DEFAULT_READING, even_unusable: bool = False
) -> LaserLog:
    """The log at a path ("-": standard input), or in a folder or several files that a recorder has left.

    Its kind is found from its content. Raises InputMissingError when there is nothing to read,
    InputDataError when it is no log, a damaged one, or one none of whose readings counts (but with
    `even_unusable`), WrongUsageError when the options do not fit it, or the paths are of several.
    """
    parts = parts_of(paths)
    if len(parts.files) > 1:
        log = _usable(_of_parts(parts, options), even_unusable)
    else:
        (path,) = parts.files
        log = log_from(stored_bytes(path), path, options, even_unusable)
    return _noted(log, parts.warnings)


def stored_bytes(path: str) -> FileBytes:
    """The bytes of a log as they are stored. Those of a recording in a file are not taken into memory.

    Raises InputMissingError, and InputDataError when there are more than the limit allows.
    """
    head = first_bytes(path)
    if any(form.container and form.fits(head) for form in FORMS if form.magic is not None):
        return memory_map(path)
    return read_bytes(path)


def recording_from(stored: FileBytes, path: str, salvage: bool) -> Recording | None:
    """The messages of the recording whose bytes `path` has; None where it is none. Raises InputDataError."""
    data, lost = _content(stored, path, salvage)
    form = next((form for form in FORMS if form.container and form.fits(data)), None)
    if form is None:
        return None
    try:
        recording = _recording(form, data, path, salvage)
    except LimitExceededError as error:
        raise InputDataError(label(path), str(error), error.remedy) from error
    recording.warnings[:0] = [] if lost is None else [lost]
    return recording


def read_recording(folder: str, salvage: bool) -> Recording | None:
    """The messages of the recording in a folder; raises as read_log does."""
    parts = parts_of(folder)
    if len(parts.files) > 1:
        recording: Recording | None = _joined(parts, salvage)[0]
    else:
        (path,) = parts.files
        recording = recording_from(stored_bytes(path), path, salvage)
    if recording is not None:
        recording.warnings[:0] = parts.warnings
    return recording


def log_from(
    stored: FileBytes, path: str, options: ReadingOptions = DEFAULT_READING, even_unusable: bool = False
) -> LaserLog:
    """The log in the bytes that `path` has; raises the same errors."""
    name = label(path)
    data, lost = _content(stored, path, options.salvage)
    if not re.search(rb"\S", data):
        raise InputDataError(name, lost or "is empty", "give a log with laser scans")
    form = _form(data, name)
    source = _source(stored, path)
    del stored
    try:
        if form.container:
            recording = _recording(form, data, path, options.salvage)
            del data
            log = _scans(recording, name, source, options)
        else:
            assert isinstance(data, bytes)
            reader: Reader = form.reader()
            log = reader.read(data, name, source, options)
    except LimitExceededError as error:
        raise InputDataError(name, str(error), error.remedy) from error
    return _noted(_usable(log, even_unusable), () if lost is None else (lost,))


def content_of(stored: bytes, path: str, salvage: bool) -> tuple[bytes, str | None]:
    """What the bytes of `path` hold when they are unpacked, and what was lost when that was allowed.

    Raises InputDataError.
    """
    packing = compression_of(stored)
    if packing is None:
        return without_byte_order_mark(stored, label(path)), None
    try:
        content, problem = decompressed(stored, packing)
    except LimitExceededError as error:
        raise InputDataError(label(path), str(error), error.remedy) from error
    content = without_byte_order_mark(content, label(path))
    if problem is None:
        return content, None
    if not salvage:
        raise InputDataError(label(path), problem, DAMAGE_REMEDY)
    return content, f"{problem}: the rest is lost"


def _content(stored: FileBytes, path: str, salvage: bool) -> tuple[FileBytes, str | None]:
    """The same; what is in its place in a file is not compressed."""
    return content_of(stored, path, salvage) if isinstance(stored, bytes) else (stored, None)


def _of_parts(parts: Parts, options: ReadingOptions) -> LaserLog:
    """The log in several files of one recording."""
    whole, source = _joined(parts, options.salvage)
    return _scans(whole, parts.title, source, options)


def _joined(parts: Parts, salvage: bool) -> tuple[Recording, Source]:
    """The messages in several files of one recording, of which one at a time is in memory, and the files."""
    found: list[tuple[str, Recording]] = []
    sources: list[tuple[Source, ...]] = []
    first: tuple[str, str] | None = None
    try:
        for path in parts.files:
            stored = stored_bytes(path)
            data, lost = _content(stored, path, salvage)
            form = _form(data, path)
            if not form.container:
                problem = f"{path}: is {form.name}, no recording"
                raise WrongUsageError(f"{problem}; several LOGs have to be the files of one recording")
            first = first or (path, form.name)
            if form.name != first[1]:
                raise split_recordings.different_forms(first, (path, form.name))
            sources.append(_source(stored, path).files)
            del stored
            recording = _recording(form, data, path, salvage)
            del data
            recording.warnings[:0] = [] if lost is None else [lost]
            found.append((base_name(path), recording))
        order = split_recordings.order_by_start(found)
        whole = split_recordings.merge_recordings([found[place] for place in order], parts.are_parts)
    except LimitExceededError as error:
        raise InputDataError(parts.title, str(error), error.remedy) from error
    del found
    return whole, _together(parts.name, [file for place in order for file in sources[place]])


def _scans(recording: Recording, name: str, source: Source, options: ReadingOptions) -> LaserLog:
    """The scans of a recording; texts need none of what decodes messages."""
    from nscan_cli.logs.recordings.laser_scans import log_from_recording

    return log_from_recording(recording, name, source, options)


def _form(data: FileBytes, name: str) -> Form:
    for form in FORMS:
        if form.fits(data):
            return form
    found = foreign_kind(bytes(data))
    remedy = found.remedy or f"give a log: {readable_forms()}"
    raise InputDataError(name, f"is {found.name}", remedy)


def _recording(form: Form, data: FileBytes, path: str, salvage: bool) -> Recording:
    """The messages in a container: of a database from its file, where it is one and not compressed."""
    if form.by_path and isinstance(data, mmap):
        database: Database = form.reader()
        return database.read_recording_file(path, journals_of(path), label(path), salvage)
    container: Container = form.reader()
    return container.read_recording(data, label(path), salvage)


def _source(stored: FileBytes, path: str) -> Source:
    """The file, and what stands beside it."""
    name = base_name(path)
    sha256 = hashlib.sha256(stored).hexdigest() if isinstance(stored, bytes) else sha256_of(path)
    more = [
        Source(name + end, sha256_of(other), os.path.getsize(other))
        for end, other in journals_of(path).items()
    ]
    file = Source(name, sha256, len(stored))
    return _together(name, [file, *more]) if more else file


def _together(name: str, files: Sequence[Source]) -> Source:
    """Files as one source."""
    return Source(
        name, common_hash(file.sha256 for file in files), sum(file.bytes for file in files), tuple(files)
    )


def _usable(log: LaserLog, even_unusable: bool) -> LaserLog:
    """The log. Raises InputDataError where none of its readings counts, unless that is no matter."""
    if log.report.unusable is not None and not even_unusable:
        raise log.report.unusable
    return log


def _noted(log: LaserLog, warnings: Sequence[str]) -> LaserLog:
    """The log with more warnings, before its own."""
    if not warnings:
        return log
    return replace(log, report=replace(log.report, warnings=(*warnings, *log.report.warnings)))
