"""The files of a split recording → one recording, in order of time."""

from __future__ import annotations

from collections.abc import Sequence

from nscan_cli.errors import WrongUsageError
from nscan_cli.logs.recordings.container import Recording
from nscan_cli.logs.recordings.decoded_messages import S
from nscan_cli.logs.scan_order import ScanOrderOptions


def start_of(recording: Recording) -> int:
    """When the first message was recorded, ns; 0 without messages."""
    return (_time_span(recording) or (0, 0))[0]


def merge_recordings(recordings: Sequence[tuple[str, Recording]], are_parts: bool) -> Recording:
    """One recording of several named ones, which are in the order of their starts.

    `are_parts` says that metadata or names show that they belong together; otherwise a long pause is an
    error. Raises WrongUsageError for it, and LimitExceededError when they are too large together.
    """
    whole = Recording(recordings[0][1].form)
    checksums: dict[str, None] = {}
    last: tuple[int, str] | None = None
    for name, recording in recordings:
        whole.add_kept(recording.kept_bytes)
        whole.counts |= recording.counts
        whole.warnings += [f"{name}: {warning}" for warning in recording.warnings]
        checksums[recording.checksums] = None
        for topic, messages in recording.messages.items():
            whole.messages.setdefault(topic, []).extend(messages)
        span = _time_span(recording)
        if span is None:
            continue
        pause = 0.0 if last is None else (span[0] - last[0]) / S
        if last is not None and pause > ScanOrderOptions.longest_pause:
            problem = f"{name} begins {pause:,.0f} s after {last[1]} ends"
            if not are_parts:
                raise WrongUsageError(
                    f"{problem}: they are not files of one recording; give one of them alone"
                )
            whole.warnings.append(problem)
        last = max(last or (0, ""), (span[1], name))
    whole.checksums = "; ".join(checksums)
    for messages in whole.messages.values():
        messages.sort(key=lambda message: message.log_time)
    return whole


def _time_span(recording: Recording) -> tuple[int, int] | None:
    """When the first and the last message were recorded (ns); None without messages."""
    times = [message.log_time for messages in recording.messages.values() for message in messages]
    return (min(times), max(times)) if times else None
