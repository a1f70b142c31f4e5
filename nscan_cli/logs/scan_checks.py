"""The options of reading a log and of the checks that correct it meanwhile."""

from __future__ import annotations

from dataclasses import dataclass, field

from nscan_cli.logs.angle_unit import AngleUnitOptions
from nscan_cli.logs.beam_angles import BeamAngleOptions
from nscan_cli.logs.bent_walls import BentWallOptions
from nscan_cli.logs.blind_scans import BlindScanOptions
from nscan_cli.logs.dead_beams import DeadBeamOptions
from nscan_cli.logs.direction_changes import DirectionChangeOptions
from nscan_cli.logs.floor_line import FloorLineOptions
from nscan_cli.logs.heading_unit import HeadingUnitOptions
from nscan_cli.logs.jittery_odometry import JitteryOdometryOptions
from nscan_cli.logs.odometry_interpolation import OdometryGapOptions
from nscan_cli.logs.odometry_outliers import OdometryOutlierOptions
from nscan_cli.logs.range_noise import RangeNoiseOptions
from nscan_cli.logs.range_offset import RangeOffsetOptions
from nscan_cli.logs.range_peaks import RangeLimitOptions
from nscan_cli.logs.range_unit import RangeUnitOptions
from nscan_cli.logs.recordings.alternating_lasers import TwoLaserOptions
from nscan_cli.logs.recordings.moving_mount import MountingOptions
from nscan_cli.logs.recordings.orientations import OrientationOptions
from nscan_cli.logs.recordings.sweep_segments import SweepSegmentOptions
from nscan_cli.logs.repeated_reading import RepeatedReadingOptions
from nscan_cli.logs.robot_parts import RobotPartsOptions
from nscan_cli.logs.robot_path import RobotPathOptions
from nscan_cli.logs.rolled_readings import RolledReadingOptions
from nscan_cli.logs.rounded_ranges import RoundedRangeOptions
from nscan_cli.logs.scan_order import ScanOrderOptions
from nscan_cli.logs.shared_stamps import SharedStampOptions
from nscan_cli.logs.slow_odometry import SlowOdometryOptions
from nscan_cli.logs.square_length import SquareLengthOptions
from nscan_cli.logs.square_walls import SquareWallOptions
from nscan_cli.logs.stamp_unit import StampUnitOptions
from nscan_cli.logs.sweep import SweepOptions
from nscan_cli.logs.text.interlaced_scans import InterlacedOptions
from nscan_cli.logs.text.text_log_options import TextLogOptions
from nscan_cli.logs.two_odometries import TwoOdometriesOptions
from nscan_cli.logs.unit_by_odometry import UnitByOdometryOptions
from nscan_cli.logs.unit_stretches import UnitStretchOptions
from nscan_cli.logs.wall_angles import BeamSpacingOptions
from nscan_cli.logs.whole_revolution import WholeRevolutionOptions


@dataclass(frozen=True)
class ScanCheckOptions:
    """The options of reading, as the provenance of a graph has them: the defaults of its steps."""

    stamp_unit: StampUnitOptions = field(default_factory=StampUnitOptions)
    """Whether stamps are in seconds."""
    scan_order: ScanOrderOptions = field(default_factory=ScanOrderOptions)
    """Whether stamps are usable, and the order of scans by them."""
    shared_stamps: SharedStampOptions = field(default_factory=SharedStampOptions)
    """Scans that share a stamp."""
    range_limits: RangeLimitOptions = field(default_factory=RangeLimitOptions)
    """The limits of the laser, and readings at them."""
    repeated_reading: RepeatedReadingOptions = field(default_factory=RepeatedReadingOptions)
    """A reading that stands for none."""
    range_unit: RangeUnitOptions = field(default_factory=RangeUnitOptions)
    """Whether all readings are in metres."""
    unit_by_odometry: UnitByOdometryOptions = field(default_factory=UnitByOdometryOptions)
    """Whether all readings are in metres, by odometry."""
    unit_stretches: UnitStretchOptions = field(default_factory=UnitStretchOptions)
    """Whether some scans are in another unit than the others."""
    rounded_ranges: RoundedRangeOptions = field(default_factory=RoundedRangeOptions)
    """Whether ranges were rounded."""
    range_noise: RangeNoiseOptions = field(default_factory=RangeNoiseOptions)
    """Whether ranges are noisy."""
    blind_scans: BlindScanOptions = field(default_factory=BlindScanOptions)
    """Scans that see nothing for long."""
    angle_unit: AngleUnitOptions = field(default_factory=AngleUnitOptions)
    """Whether angles are in radians."""
    beam_angles: BeamAngleOptions = field(default_factory=BeamAngleOptions)
    """Whether first and last direction fit the angle between beams."""
    direction_changes: DirectionChangeOptions = field(default_factory=DirectionChangeOptions)
    """Whether directions change in the file alone."""
    beam_spacing: BeamSpacingOptions = field(default_factory=BeamSpacingOptions)
    """Whether walls fit the angle between beams."""
    square_walls: SquareWallOptions = field(default_factory=SquareWallOptions)
    """Whether walls are square to each other with it."""
    square_length: SquareLengthOptions = field(default_factory=SquareLengthOptions)
    """Which length on all ranges makes more walls square to each other."""
    bent_walls: BentWallOptions = field(default_factory=BentWallOptions)
    """Which length on all ranges bends walls."""
    range_offset: RangeOffsetOptions = field(default_factory=RangeOffsetOptions)
    """Whether a length is added to all ranges."""
    whole_turn: WholeRevolutionOptions = field(default_factory=WholeRevolutionOptions)
    """Whether beams cover a whole revolution. Saved graphs have this name, and `turn_segments`."""
    text_logs: TextLogOptions = field(default_factory=TextLogOptions)
    """What numbers in text logs may be."""
    interlaced: InterlacedOptions = field(default_factory=InterlacedOptions)
    """Whether scans of a CARMEN log are interlaced."""
    turn_segments: SweepSegmentOptions = field(default_factory=SweepSegmentOptions)
    """Whether messages are segments of sweeps."""
    two_lasers: TwoLaserOptions = field(default_factory=TwoLaserOptions)
    """Whether a topic has the scans of two lasers."""
    rolled_readings: RolledReadingOptions = field(default_factory=RolledReadingOptions)
    """Whether readings begin in the middle of the scan."""
    robot_parts: RobotPartsOptions = field(default_factory=RobotPartsOptions)
    """Beams that see the robot itself."""
    floor_line: FloorLineOptions = field(default_factory=FloorLineOptions)
    """Beams that see the floor."""
    dead_beams: DeadBeamOptions = field(default_factory=DeadBeamOptions)
    """Beams that always have the same reading."""
    mounting: MountingOptions = field(default_factory=MountingOptions)
    """Whether the laser is level and at rest on the robot."""
    orientations: OrientationOptions = field(default_factory=OrientationOptions)
    """Whether orientations are turns about the vertical."""
    odometry_gaps: OdometryGapOptions = field(default_factory=OdometryGapOptions)
    """Gaps in the odometry over which nothing is interpolated."""
    heading_unit: HeadingUnitOptions = field(default_factory=HeadingUnitOptions)
    """Whether headings are in radians."""
    two_odometries: TwoOdometriesOptions = field(default_factory=TwoOdometriesOptions)
    """Whether poses come from two sources."""
    jittery_odometry: JitteryOdometryOptions = field(default_factory=JitteryOdometryOptions)
    """Odometry that goes to and fro as no robot does."""
    odometry_outliers: OdometryOutlierOptions = field(default_factory=OdometryOutlierOptions)
    """Single wrong poses of the odometry."""
    slow_odometry: SlowOdometryOptions = field(default_factory=SlowOdometryOptions)
    """Poses that repeat each other since odometry is slow."""
    robot_path: RobotPathOptions = field(default_factory=RobotPathOptions)
    """How the robot moves between two poses."""
    sweep: SweepOptions = field(default_factory=SweepOptions)
    """Which times of a sweep of the laser can be."""


SCAN_CHECKS = ScanCheckOptions()
"""What all logs are read with."""
