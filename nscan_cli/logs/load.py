"""A log from its path: read the bytes, decompress them, recognise the form and call its reader."""

from __future__ import annotations

import hashlib
import os
import re
import traceback
from collections.abc import Sequence
from dataclasses import replace
from mmap import mmap

from nscan_cli.errors import InputDataError, WrongUsageError
from nscan_cli.files.encoding import without_byte_order_mark
from nscan_cli.files.inputs import (
    FileBytes,
    base_name,
    common_hash,
    label,
    limits_as_input_errors,
    memory_map,
    read_bytes,
    sha256_of,
)
from nscan_cli.files.provenance import Source
from nscan_cli.logs.compression import compression_of, decompressed
from nscan_cli.logs.formats import FORMS, Form, foreign_kind, readable_forms
from nscan_cli.logs.laser_log import LaserLog
from nscan_cli.logs.log_files import Parts, first_bytes, journals_of, parts_of
from nscan_cli.logs.reading_options import ReadingOptions
from nscan_cli.logs.recordings.container import DAMAGE_REMEDY, Recording
from nscan_cli.logs.recordings.split_recordings import merge_recordings, start_of

RESERVED_MEMORY = 4 << 20
"""Bytes that are freed when memory runs out, so that the error can be handled."""


def read_log(
    paths: str | Sequence[str], options: ReadingOptions = ReadingOptions(), even_unusable: bool = False
) -> LaserLog:
    """The log at a path ("-": standard input), in a folder, or in the files of a split recording.

    The form is recognised by the content. Raises InputMissingError if there is nothing to read,
    InputDataError if it is no log, is damaged, or has no usable reading (unless `even_unusable`), and
    WrongUsageError if the options do not fit the log or the paths belong to several recordings.
    """
    parts = parts_of(paths)
    if len(parts.files) > 1:
        from nscan_cli.logs.recordings.laser_scans import log_from_recording

        recording, source = _merged_recording(parts, options.salvage)
        log = log_from_recording(recording, parts.title, source, options)
        _check_usable(log, even_unusable)
    else:
        (path,) = parts.files
        log = log_from(stored_bytes(path), path, options, even_unusable)
    return _with_warnings(log, parts.warnings)


def stored_bytes(path: str) -> FileBytes:
    """The bytes of a log as stored. A recording in a file is mapped and not read into memory.

    Raises InputMissingError, and InputDataError if the file exceeds the limit.
    """
    head = first_bytes(path)
    if any(form.container and form.fits(head) for form in FORMS if form.magic is not None):
        return memory_map(path)
    return read_bytes(path)


def recording_from(stored: FileBytes, path: str, salvage: bool) -> Recording | None:
    """The messages of the recording at `path`, or None if it is no recording. Raises InputDataError."""
    data, lost = content_of(stored, path, salvage)
    form = next((form for form in FORMS if form.container and form.fits(data)), None)
    if form is None:
        return None
    with limits_as_input_errors(label(path)):
        return _messages(form, data, path, salvage, lost)


def read_recording(folder: str, salvage: bool) -> Recording | None:
    """The messages of the recording in a folder. Raises the errors of read_log."""
    parts = parts_of(folder)
    if len(parts.files) > 1:
        recording: Recording | None = _merged_recording(parts, salvage)[0]
    else:
        (path,) = parts.files
        recording = recording_from(stored_bytes(path), path, salvage)
    if recording is not None:
        recording.warnings[:0] = parts.warnings
    return recording


def log_from(
    stored: FileBytes, path: str, options: ReadingOptions = ReadingOptions(), even_unusable: bool = False
) -> LaserLog:
    """The log in the stored bytes of `path`. Raises the errors of read_log."""
    name = label(path)
    data, lost = content_of(stored, path, options.salvage)
    if not re.search(rb"\S", data):
        raise InputDataError(name, lost[0] if lost else "is empty", "give a log with laser scans")
    form = _form(data, name)
    source = _source(stored, path)
    # The bytes are freed before the scans are made.
    del stored
    with limits_as_input_errors(name):
        if form.container:
            # Text logs need no decoders of messages.
            from nscan_cli.logs.recordings.laser_scans import log_from_recording

            recording = _messages(form, data, path, options.salvage, lost)
            del data
            log = log_from_recording(recording, name, source, options)
        else:
            assert isinstance(data, bytes)
            # Python 3.11 can loop for ever at the end of a `with` block when no memory at all is left.
            reserve = bytearray(RESERVED_MEMORY)
            try:
                log = _with_warnings(form.reader().read(data, name, source, options), lost)
            except MemoryError as error:
                del reserve
                traceback.clear_frames(error.__traceback__)
                raise
    _check_usable(log, even_unusable)
    return log


def content_of(stored: FileBytes, path: str, salvage: bool) -> tuple[FileBytes, list[str]]:
    """The decompressed bytes of `path`, and with `salvage` a warning about what was lost.

    A mapped file is not compressed. Raises InputDataError if the bytes are damaged or too many.
    """
    if not isinstance(stored, bytes):
        return stored, []
    packing = compression_of(stored)
    if packing is None:
        return without_byte_order_mark(stored, label(path)), []
    with limits_as_input_errors(label(path)):
        content, problem = decompressed(stored, packing)
    content = without_byte_order_mark(content, label(path))
    if problem is None:
        return content, []
    if not salvage:
        raise InputDataError(label(path), problem, DAMAGE_REMEDY)
    return content, [f"{problem}: the rest is lost"]


def _merged_recording(parts: Parts, salvage: bool) -> tuple[Recording, Source]:
    """The messages in several files of one recording, and the files. One file at a time is in memory."""
    found: list[tuple[str, Recording, Source]] = []
    first = ""
    with limits_as_input_errors(parts.title):
        for path in parts.files:
            stored = stored_bytes(path)
            data, lost = content_of(stored, path, salvage)
            form = _form(data, path)
            if not form.container:
                problem = f"{path}: is {form.name}, not a recording"
                raise WrongUsageError(f"{problem}; several LOGs must be the files of one recording")
            first = first or form.name
            if form.name != first:
                raise WrongUsageError(
                    f"{parts.files[0]} is {first}, {path} {form.name}: they are not files of one recording; "
                    "give one of them alone"
                )
            source = _source(stored, path)
            del stored
            found.append((base_name(path), _messages(form, data, path, salvage, lost), source))
            del data
        found.sort(key=lambda each: start_of(each[1]))
        whole = merge_recordings([each[:2] for each in found], parts.are_parts)
    return whole, _joint_source(parts.name, [file for each in found for file in each[2].files])


def _form(data: FileBytes, name: str) -> Form:
    """The form of a log. Raises InputDataError if it is none that is read."""
    for form in FORMS:
        if form.fits(data):
            return form
    found = foreign_kind(bytes(data))
    raise InputDataError(name, f"is {found.name}", found.remedy or f"give a log: {readable_forms()}")


def _messages(form: Form, data: FileBytes, path: str, salvage: bool, warnings: list[str]) -> Recording:
    """The messages in a container, with `warnings` before its own.

    An SQLite database that is not compressed is read from its file.
    """
    if form.by_path and isinstance(data, mmap):
        found = form.reader().read_recording_file(path, journals_of(path), label(path), salvage)
    else:
        found = form.reader().read_recording(data, label(path), salvage)
    recording: Recording = found
    recording.warnings[:0] = warnings
    return recording


def _source(stored: FileBytes, path: str) -> Source:
    name = base_name(path)
    sha256 = hashlib.sha256(stored).hexdigest() if isinstance(stored, bytes) else sha256_of(path)
    journals = [
        Source(name + suffix, sha256_of(journal), os.path.getsize(journal))
        for suffix, journal in journals_of(path).items()
    ]
    file = Source(name, sha256, len(stored))
    return _joint_source(name, [file, *journals]) if journals else file


def _joint_source(name: str, files: Sequence[Source]) -> Source:
    return Source(
        name, common_hash(file.sha256 for file in files), sum(file.bytes for file in files), tuple(files)
    )


def _check_usable(log: LaserLog, even_unusable: bool) -> None:
    if log.report.unusable is not None and not even_unusable:
        raise log.report.unusable


def _with_warnings(log: LaserLog, warnings: Sequence[str]) -> LaserLog:
    if not warnings:
        return log
    return replace(log, report=replace(log.report, warnings=(*warnings, *log.report.warnings)))
