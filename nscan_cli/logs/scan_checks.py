"""The options of reading a log and of the checks that correct it meanwhile."""

from __future__ import annotations

from dataclasses import dataclass, field

from nscan_cli.logs.angle_unit import AngleUnitOptions
from nscan_cli.logs.beam_angles import BeamAngleOptions
from nscan_cli.logs.beam_spacing_options import BeamSpacingOptions
from nscan_cli.logs.blind_scans import BlindScanOptions
from nscan_cli.logs.dead_beams import DeadBeamOptions
from nscan_cli.logs.direction_changes import DirectionChangeOptions
from nscan_cli.logs.floor_line import FloorLineOptions
from nscan_cli.logs.heading_unit import HeadingUnitOptions
from nscan_cli.logs.noisy_odometry import NoisyOdometryOptions
from nscan_cli.logs.odometry_interpolation import OdometryGapOptions
from nscan_cli.logs.odometry_outliers import OdometryOutlierOptions
from nscan_cli.logs.range_limit_options import RangeLimitOptions
from nscan_cli.logs.range_unit import RangeUnitOptions
from nscan_cli.logs.recordings.alternating_lasers import TwoLaserOptions
from nscan_cli.logs.recordings.mounting_options import MountingOptions
from nscan_cli.logs.recordings.orientations import OrientationOptions
from nscan_cli.logs.recordings.turn_segments import TurnSegmentOptions
from nscan_cli.logs.repeated_reading import RepeatedReadingOptions
from nscan_cli.logs.robot_parts import RobotPartsOptions
from nscan_cli.logs.robot_path import RobotPathOptions
from nscan_cli.logs.rounded_ranges import RoundedRangeOptions
from nscan_cli.logs.scan_order import ScanOrderOptions
from nscan_cli.logs.shared_stamps import SharedStampOptions
from nscan_cli.logs.slow_odometry import SlowOdometryOptions
from nscan_cli.logs.stamp_unit import StampUnitOptions
from nscan_cli.logs.sweep import SweepOptions
from nscan_cli.logs.text.interlaced_scans import InterlacedOptions
from nscan_cli.logs.text.text_log_options import TextLogOptions
from nscan_cli.logs.two_odometries import TwoOdometriesOptions
from nscan_cli.logs.unit_stretches import UnitStretchOptions
from nscan_cli.logs.whole_turn import WholeTurnOptions


@dataclass(frozen=True)
class ScanCheckOptions:
    """The options of reading, as the provenance of a graph has them.

    `laser_log` passes on those of its steps. Readers have the defaults of the others.
    """

    stamp_unit: StampUnitOptions = field(default_factory=StampUnitOptions)
    scan_order: ScanOrderOptions = field(default_factory=ScanOrderOptions)
    shared_stamps: SharedStampOptions = field(default_factory=SharedStampOptions)
    range_limits: RangeLimitOptions = field(default_factory=RangeLimitOptions)
    repeated_reading: RepeatedReadingOptions = field(default_factory=RepeatedReadingOptions)
    range_unit: RangeUnitOptions = field(default_factory=RangeUnitOptions)
    unit_stretches: UnitStretchOptions = field(default_factory=UnitStretchOptions)
    rounded_ranges: RoundedRangeOptions = field(default_factory=RoundedRangeOptions)
    blind_scans: BlindScanOptions = field(default_factory=BlindScanOptions)
    angle_unit: AngleUnitOptions = field(default_factory=AngleUnitOptions)
    beam_angles: BeamAngleOptions = field(default_factory=BeamAngleOptions)
    direction_changes: DirectionChangeOptions = field(default_factory=DirectionChangeOptions)
    beam_spacing: BeamSpacingOptions = field(default_factory=BeamSpacingOptions)
    whole_turn: WholeTurnOptions = field(default_factory=WholeTurnOptions)
    text_logs: TextLogOptions = field(default_factory=TextLogOptions)
    interlaced: InterlacedOptions = field(default_factory=InterlacedOptions)
    turn_segments: TurnSegmentOptions = field(default_factory=TurnSegmentOptions)
    two_lasers: TwoLaserOptions = field(default_factory=TwoLaserOptions)
    robot_parts: RobotPartsOptions = field(default_factory=RobotPartsOptions)
    floor_line: FloorLineOptions = field(default_factory=FloorLineOptions)
    dead_beams: DeadBeamOptions = field(default_factory=DeadBeamOptions)
    mounting: MountingOptions = field(default_factory=MountingOptions)
    orientations: OrientationOptions = field(default_factory=OrientationOptions)
    odometry_gaps: OdometryGapOptions = field(default_factory=OdometryGapOptions)
    heading_unit: HeadingUnitOptions = field(default_factory=HeadingUnitOptions)
    two_odometries: TwoOdometriesOptions = field(default_factory=TwoOdometriesOptions)
    noisy_odometry: NoisyOdometryOptions = field(default_factory=NoisyOdometryOptions)
    odometry_outliers: OdometryOutlierOptions = field(default_factory=OdometryOutlierOptions)
    slow_odometry: SlowOdometryOptions = field(default_factory=SlowOdometryOptions)
    robot_path: RobotPathOptions = field(default_factory=RobotPathOptions)
    sweep: SweepOptions = field(default_factory=SweepOptions)


SCAN_CHECKS = ScanCheckOptions()
"""What all logs are read with."""
