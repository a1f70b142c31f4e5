"""The options of reading a log and of the checks that correct it meanwhile."""

from __future__ import annotations

from dataclasses import dataclass

from nscan_cli.logs.beam_angles import DEFAULT_BEAM_ANGLES, BeamAngleOptions
from nscan_cli.logs.beam_spacing import DEFAULT_BEAM_SPACING, BeamSpacingOptions
from nscan_cli.logs.dead_beams import DEFAULT_DEAD_BEAMS, DeadBeamOptions
from nscan_cli.logs.heading_unit import DEFAULT_HEADING_UNIT, HeadingUnitOptions
from nscan_cli.logs.odometry_interpolation import DEFAULT_ODOMETRY_GAPS, OdometryGapOptions
from nscan_cli.logs.odometry_outliers import DEFAULT_ODOMETRY_OUTLIERS, OdometryOutlierOptions
from nscan_cli.logs.range_limit_options import DEFAULT_RANGE_LIMITS, RangeLimitOptions
from nscan_cli.logs.range_unit import DEFAULT_RANGE_UNIT, RangeUnitOptions
from nscan_cli.logs.recordings.alternating_lasers import DEFAULT_TWO_LASERS, TwoLaserOptions
from nscan_cli.logs.recordings.mounting_options import DEFAULT_MOUNTING, MountingOptions
from nscan_cli.logs.recordings.turn_segments import DEFAULT_TURN_SEGMENTS, TurnSegmentOptions
from nscan_cli.logs.robot_parts import DEFAULT_ROBOT_PARTS, RobotPartsOptions
from nscan_cli.logs.robot_path import DEFAULT_ROBOT_PATH, RobotPathOptions
from nscan_cli.logs.scan_order import DEFAULT_SCAN_ORDER, ScanOrderOptions
from nscan_cli.logs.shared_stamps import DEFAULT_SHARED_STAMPS, SharedStampOptions
from nscan_cli.logs.slow_odometry import DEFAULT_SLOW_ODOMETRY, SlowOdometryOptions
from nscan_cli.logs.sweep import DEFAULT_SWEEP, SweepOptions
from nscan_cli.logs.text.interlaced_scans import DEFAULT_INTERLACED, InterlacedOptions
from nscan_cli.logs.text.text_log_options import DEFAULT_TEXT_LOGS, TextLogOptions
from nscan_cli.logs.unit_stretches import DEFAULT_UNIT_STRETCHES, UnitStretchOptions


@dataclass(frozen=True)
class ScanCheckOptions:
    """The options of reading, as the provenance of a graph has them."""

    scan_order: ScanOrderOptions = DEFAULT_SCAN_ORDER
    shared_stamps: SharedStampOptions = DEFAULT_SHARED_STAMPS
    range_limits: RangeLimitOptions = DEFAULT_RANGE_LIMITS
    range_unit: RangeUnitOptions = DEFAULT_RANGE_UNIT
    unit_stretches: UnitStretchOptions = DEFAULT_UNIT_STRETCHES
    beam_angles: BeamAngleOptions = DEFAULT_BEAM_ANGLES
    beam_spacing: BeamSpacingOptions = DEFAULT_BEAM_SPACING
    text_logs: TextLogOptions = DEFAULT_TEXT_LOGS
    interlaced: InterlacedOptions = DEFAULT_INTERLACED
    turn_segments: TurnSegmentOptions = DEFAULT_TURN_SEGMENTS
    two_lasers: TwoLaserOptions = DEFAULT_TWO_LASERS
    robot_parts: RobotPartsOptions = DEFAULT_ROBOT_PARTS
    dead_beams: DeadBeamOptions = DEFAULT_DEAD_BEAMS
    mounting: MountingOptions = DEFAULT_MOUNTING
    odometry_gaps: OdometryGapOptions = DEFAULT_ODOMETRY_GAPS
    heading_unit: HeadingUnitOptions = DEFAULT_HEADING_UNIT
    odometry_outliers: OdometryOutlierOptions = DEFAULT_ODOMETRY_OUTLIERS
    slow_odometry: SlowOdometryOptions = DEFAULT_SLOW_ODOMETRY
    robot_path: RobotPathOptions = DEFAULT_ROBOT_PATH
    sweep: SweepOptions = DEFAULT_SWEEP
