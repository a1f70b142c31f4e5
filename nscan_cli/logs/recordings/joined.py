"""Several files of one recording → one recording, in order of time."""

from __future__ import annotations

from collections.abc import Sequence

from nscan_cli.errors import WrongUsageError
from nscan_cli.logs.recordings.container import Recording
from nscan_cli.logs.recordings.decoded_messages import S

LONGEST_PAUSE = 60
"""s; a recorder that begins another file goes on at once."""


def in_order_of_time(recordings: Sequence[tuple[str, Recording]]) -> list[int]:
    """The places of recordings, those that begin earlier first; of those without messages the order stays."""

    def begin(place: int) -> int:
        span = _span(recordings[place][1])
        return span[0] if span else 0

    return sorted(range(len(recordings)), key=begin)


def joined(recordings: Sequence[tuple[str, Recording]], are_parts: bool) -> Recording:
    """One recording of those of several files, each with its name, in the order of in_order_of_time.

    `are_parts` says that something else than their times tells that they belong together. Raises
    WrongUsageError when nothing does, and ExceededError when they are too much together.
    """
    whole = Recording(recordings[0][1].form)
    checksums: dict[str, None] = {}
    last: tuple[int, str] | None = None
    for name, recording in recordings:
        whole.grow(recording.size)
        whole.counts |= recording.counts
        whole.warnings += [f"{name}: {warning}" for warning in recording.warnings]
        checksums[recording.checksums] = None
        for topic, messages in recording.messages.items():
            whole.messages.setdefault(topic, []).extend(messages)
        span = _span(recording)
        if span is None:
            continue
        pause = 0.0 if last is None else (span[0] - last[0]) / S
        if last is not None and pause > LONGEST_PAUSE:
            said = f"{name} begins {pause:,.0f} s after {last[1]} ends"
            if not are_parts:
                raise WrongUsageError(f"{said}: they are not files of one recording; give one of them alone")
            whole.warnings.append(said)
        last = max(last or (0, ""), (span[1], name))
    whole.checksums = "; ".join(checksums)
    for messages in whole.messages.values():
        messages.sort(key=lambda message: message.log_time)
    return whole


def differing(first: tuple[str, str], other: tuple[str, str]) -> WrongUsageError:
    """Two files, each with its name and form, are no parts of one recording: what to say."""
    (name, form), (other_name, other_form) = first, other
    return WrongUsageError(
        f"{name} is {form}, {other_name} {other_form}: they are not files of one recording; "
        "give one of them alone"
    )


def _span(recording: Recording) -> tuple[int, int] | None:
    """When the first message was recorded, and the last (ns); None where there is none."""
    times = [message.log_time for messages in recording.messages.values() for message in messages]
    return (min(times), max(times)) if times else None
