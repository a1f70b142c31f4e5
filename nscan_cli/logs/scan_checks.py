"""The checks of a log while it is read, which correct it."""

from __future__ import annotations

from dataclasses import dataclass

from nscan_cli.logs.beam_spacing import DEFAULT_BEAM_SPACING, BeamSpacingOptions
from nscan_cli.logs.range_unit import DEFAULT_RANGE_UNIT, RangeUnitOptions
from nscan_cli.logs.recordings.alternating_lasers import DEFAULT_TWO_LASERS, TwoLaserOptions
from nscan_cli.logs.recordings.turn_segments import DEFAULT_TURN_SEGMENTS, TurnSegmentOptions
from nscan_cli.logs.robot_parts import DEFAULT_ROBOT_PARTS, RobotPartsOptions
from nscan_cli.logs.slow_odometry import DEFAULT_SLOW_ODOMETRY, SlowOdometryOptions
from nscan_cli.logs.sweep import DEFAULT_SWEEP, SweepOptions


@dataclass(frozen=True)
class ScanCheckOptions:
    """The options of the checks that reading makes, as the provenance of a graph has them."""

    range_unit: RangeUnitOptions = DEFAULT_RANGE_UNIT
    beam_spacing: BeamSpacingOptions = DEFAULT_BEAM_SPACING
    turn_segments: TurnSegmentOptions = DEFAULT_TURN_SEGMENTS
    two_lasers: TwoLaserOptions = DEFAULT_TWO_LASERS
    robot_parts: RobotPartsOptions = DEFAULT_ROBOT_PARTS
    slow_odometry: SlowOdometryOptions = DEFAULT_SLOW_ODOMETRY
    sweep: SweepOptions = DEFAULT_SWEEP
