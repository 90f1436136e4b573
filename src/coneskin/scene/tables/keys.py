"""Every key that a scene may have: name, type, unit, range, default and meaning, in this file and ``sensor_keys``.

The readers beside this file check with them, and the reference page of the scene file is made of them.

The plain names of the keys of [reaction] and [monitoring] are the fields of the class that takes them. It has their
defaults too.
"""

from __future__ import annotations

from dataclasses import replace

from coneskin.core.keys import Key, with_meanings
from coneskin.scene.values.scene import BODY_KINDS
from coneskin.skin.sources.kinds import SOURCE_KINDS

MAX_SIZE = 256_000  #: bytes of a scene file or a sensor file; a scene of 100 sensors has 50 kB
MAX_ROWS = 20_000  #: of a table of permissible speeds

ARM_KEYS = with_meanings(
    """
    model: UR3, UR5, UR10, UR3e, UR5e, UR7e, UR8 Long, UR10e, UR12e, UR15, UR16e, UR18, UR20 or UR30, in any
        spelling, or that of an installed package
    host: name or address of the controller
    watchdog_hz: the controller ends the program through which coneskin moves the arm when it receives nothing for 1
        / `watchdog_hz`
    control: who moves the arm: your program through coneskin (internal), or any other program, which knows nothing
        of coneskin (external)
    table_z_mm: height in the base frame below which the middle of no link goes in a retreat. Add the thickness of
        the arm and the length of the tool
    payload_kg: the heaviest that the flange carries, tool included, for the permissible speeds
    payload_xyz_mm: its centre of mass in the flange's frame
    slider_stop: the guard takes the controller's speed slider, and sets it to 0, where other stops do not work. Set
        it to false for a program that must keep the slider, such as one with ur_rtde's `RTDEIOInterface`
    speed_limit_from: file of permissible speeds that `coneskin permissible` has written. The guard keeps them by
        the speed slider. The file is void after a change of arm, sheets, padding or reactions
    controller_heartbeat: with `control = "external"`: whether a program must end by itself where the guard falls
        silent or the network is cut. "required" stops a program that does not, "optional" reports it
    """,
    Key("model", str),
    Key("host", str),
    Key("watchdog_hz", float, 4.0, low=1.0, high=100.0),
    Key("control", str, "internal", choices=("internal", "external")),
    Key("table_z_mm", float, None, low=-5000.0, high=5000.0),
    Key("payload_kg", float, 0.0, low=0.0, high=100.0),
    Key("payload_xyz_mm", list, (0.0, 0.0, 0.0), low=-2000.0, high=2000.0, length=3),
    Key("slider_stop", bool, True),
    Key("speed_limit_from", str, None),
    Key("controller_heartbeat", str, "optional", choices=("required", "optional")),
)
LINK_KEYS = with_meanings(
    """
    name: with a UR arm: base, shoulder, upper_arm, forearm, wrist_1, wrist_2 or wrist_3. With another: link_1,
        link_2 and so on. Without one, any name
    frame: what `xyz_mm` and `rpy_deg` refer to: the coordinates of the link's mesh file, the link's frame in the
        arm's URDF, or its DH frame
    mesh: file of the link's mesh. Touched points are then on this mesh instead of the frustum
    sensor: the link's sensors, each under `[[link.sensor]]`
    """,
    Key("name", str),
    Key("frame", str, "mesh", choices=("mesh", "urdf", "dh")),
    Key("mesh", str, None),
    Key("sensor", dict, (), unset="none"),
)

# ---- where the bytes come from


def source_keys() -> tuple[Key, ...]:
    """Return every key that a [source] may have: ``kind``, then those of each kind."""
    meaning = "a serial port, or a virtual skin that sends the bytes of a real one"
    found = {"kind": Key("kind", str, choices=tuple(SOURCE_KINDS), meaning=meaning)}
    for kind, row in SOURCE_KINDS.items():
        for key in row.keys:
            found.setdefault(key.name, replace(key, meaning=f"{key.meaning}; {kind} only"))
    return tuple(found.values())


TOUCH_KEYS = with_meanings(
    """
    sensor: `id` of the sensor
    start_s: start of the touch, counted from the first frame
    end_s: its end, after `start_s`
    u_mm: slant distance from end 1, on the sensor
    phi_deg: azimuth, on the sensor
    force_n: largest force. The layers begin to touch at 0.5 N, once the foam has yielded, and part some 30 ms after
        5 N
    radius_mm: radius of the face of a flat body; 0 for a round body, whose contact grows with the force (4 mm at
        1.5 N, 6.6 mm at 5 N)
    grown_force_n: to which the force changes evenly once it has risen to `force_n`; 0: it stays
    growth_time_s: time in which it does; above 0 where `grown_force_n` is given
    """,
    Key("sensor", int, None, low=0, high=255, unset="the first"),
    Key("start_s", low=0.0),
    Key("end_s", low=0.0),
    Key("u_mm", low=0.0, high=10_000.0),
    Key("phi_deg", low=0.0, high=360.0),
    Key("force_n", float, 5.0, low=0.0, high=1000.0),
    Key("radius_mm", float, 0.0, low=0.0, high=500.0),
    Key("grown_force_n", float, 0.0, low=0.0, high=1000.0),
    Key("growth_time_s", float, 0.0, low=0.0),
)

# ---- what the arm does; defaults as of ``Reaction``

_REACTION_KIND = Key(
    "kind",
    str,
    choices=("slow", "comply", "retreat", "stop"),
    meaning="what the arm does when it is touched. `retreat` and `comply` need a commissioning",
)
_REACTION_SETTINGS = with_meanings(
    """
    deceleration_rad_s2: deceleration of the leading joint while stopping
    distance_mm: distance by which the touched point retreats, or gives way
    speed_mm_s: speed of the touched point
    time_budget_s: time after which the retreat ends wherever it is. A touch that slows the arm for longer stops it
    arm_distance_mm: distance that no point of the bare arm goes from where the retreat began. The tool is not
        known. Points farther out from the joints that turn go farther than the touched point. So a retreat from a
        touch near a joint mostly ends here, before `distance_mm`
    bare_side: whether a retreat, or giving way, may move outward what no skin covers. With "stop" the arm then only
        stops. With "allowed" it may in a retreat. No bare point is faster than 8 mm/s, and only the motor currents
        feel what it meets. With "fast" it is as fast as elsewhere: only where nothing can be there
    slow_to: position of the controller's speed slider while slow
    press_mm: how far the touched surface may move into the touch while the arm is slow, the way of a stop included.
        What moves into it faster is stopped at once
    """,
    Key("deceleration_rad_s2", float, None, low=0.5, high=40.0),
    Key("distance_mm", float, None, low=1.0, high=500.0),
    Key("speed_mm_s", float, None, low=1.0, high=1500.0),
    Key("time_budget_s", float, None, low=0.05, high=60.0),
    Key("arm_distance_mm", float, None, low=1.0, high=2000.0),
    Key("bare_side", str, None, choices=("stop", "allowed", "fast")),
    Key("slow_to", float, None, low=0.05, high=0.9),
    Key("press_mm", float, None, low=0.1, high=100.0),
)
REACTION_KEYS = (
    _REACTION_KIND,
    *_REACTION_SETTINGS,
    Key("rule", dict, (), unset="none", meaning="reactions with conditions, each under `[[reaction.rule]]`"),
)
RULE_KEYS = with_meanings(
    """
    link: the touched link
    level_above: the touch is firmer than this
    speed_above_rad_s: the leading joint was faster than this when the touch began
    """,
    Key("link", str, None, unset="any"),
    Key("level_above", float, None, low=0.0, high=1.0, unset="any"),
    Key("speed_above_rad_s", float, None, low=0.0, high=10.0, unset="any"),
    replace(_REACTION_KIND, meaning="as in `[reaction]`"),
    *(replace(key, unset="as above", meaning="as in `[reaction]`") for key in _REACTION_SETTINGS),
)

# ---- limits, recording, motion, commissioning; [monitoring] has the defaults of ``MonitoringLimits``

MONITORING_KEYS = with_meanings(
    """
    skin_silence_ms: longest time without a valid frame of a sensor, and longest lag of its frames behind the
        device's clock. After both, what was measured last is twice as old
    clock_drift_ppm: largest difference in speed of the device's clock and this computer's. A lag that grows more
        slowly is not noticed. Crystals keep 100. A board with a ceramic resonator, as many 8-bit boards, needs 5000
    stuck_frames: frames in which any one of radial current, angular current and supply repeats its value, from
        which on the device counts as stuck; 0 where its readings have no noise
    arm_silence_ms: longest age of the controller's newest state, its way through the network included
    escalate_ms: without a slowdown for this long after a stop, the next stop path is used
    settle_ms: time for which all preconditions must hold without a break before the guard becomes active
    program_silence_ms: longest time for which your program may be suspended. A third more holds for the heartbeat of
        driver process or guard watchdog, and for a request
    """,
    Key("skin_silence_ms", float, None, low=2.0, high=1000.0),
    Key("clock_drift_ppm", float, None, low=1.0, high=50_000.0),
    Key("stuck_frames", int, None, low=0, high=1_000_000),
    Key("arm_silence_ms", float, None, low=4.0, high=1000.0),
    Key("escalate_ms", float, None, low=4.0, high=500.0),
    Key("settle_ms", float, None, low=10.0, high=10_000.0),
    Key("program_silence_ms", float, None, low=60.0, high=5000.0),
)
RECORDING_KEYS = with_meanings(
    """
    folder: folder in which each run makes a folder of its own, for its owner alone, with all that `coneskin replay`
        needs
    max_mb: size of a file, from which on a run goes on in a new one: `run.0001.rec` and so on. An hour of an arm
        and a sensor has about 200 MB
    keep: newest files of a run that stay whole. In older ones only the events stay, and all that was recorded 5 s
        before and after touches, stops and faults. Such a run says what was dropped, and cannot be replayed as a
        whole. It needs `max_mb`
    """,
    Key("folder", str),
    Key("max_mb", float, None, low=1.0, high=60_000.0),
    Key("keep", int, None, low=1, high=100_000, unset="all"),
)
MOTION_KEYS = with_meanings(
    """
    waypoints_deg: a list of joint positions, two at least, within the limits of the arm's joints
    speed_deg_s: speed of the leading joint
    acceleration_deg_s2: acceleration of the leading joint
    rounds: number of rounds; 0 for no end
    """,
    Key("waypoints_deg", list, low=-363.0, high=363.0, length=6),
    Key("speed_deg_s", float, low=1.0, high=360.0),
    Key("acceleration_deg_s2", float, low=1.0, high=2000.0),
    Key("rounds", int, 0, low=0),
)
COMMISSIONING_KEYS = with_meanings(
    "max_age_days: age from which on the commissioning record is void",
    Key("max_age_days", float, None, low=0.0, high=10_000.0, above=True),
)

# ---- what only the physics engine asks for

BODY_KEYS = with_meanings(
    """
    kind: a plate, a round bar, a free mass, a mass on a spring (hand or head), a hand that pushes back, two hands
        that close on the link
    xyz_mm: middle in the base frame; of a wall, middle of its face
    direction: outward normal of a wall, axis of a post; of a grip, the way from the first hand to the second in
        metres
    radius_mm: of a ball or a bar; half the edge of a wall
    length_mm: of a bar
    mass_kg: effective mass; all that gives way needs it
    stiffness_n_per_mm: of the spring that holds it; `hand`, `person` and `grip` need it
    damping_ratio: damping of that spring as a share of what is critical
    force_n: that a person wants, or each hand of a grip; they need it
    speed_mm_s: at which a person follows or yields at most
    delay_ms: from the first contact to the push, or the closing of the grip
    """,
    Key("kind", str, choices=tuple(BODY_KINDS)),
    Key("xyz_mm", list, low=-10_000.0, high=10_000.0, length=3),
    Key("direction", list, None, low=-1e3, high=1e3, length=3),
    Key("radius_mm", float, 0.04, low=1.0, high=2000.0),
    Key("length_mm", float, 0.3, low=1.0, high=5000.0),
    Key("mass_kg", float, None, low=0.05, high=1000.0),
    Key("stiffness_n_per_mm", float, None, low=0.1, high=10_000.0),
    Key("damping_ratio", float, 0.3, low=0.0, high=5.0),
    Key("force_n", float, None, low=0.0, high=500.0),
    Key("speed_mm_s", float, 0.25, low=1.0, high=2000.0),
    Key("delay_ms", float, 0.15, low=0.0, high=10_000.0),
)
PADDING_KEYS = with_meanings(
    """
    thickness_mm: indentation at which it bottoms out
    stiffness_n_per_mm: until there, for a body of the size of a hand
    depths_mm: indentations that you have measured, in place of both, rising from above 0
    forces_n: the force of each, at most doubling from one to the next
    spread: share by which the force of any indentation may be off, for the permissible speeds
    hard_n_per_mm: stiffness beyond
    loss_s_per_m: damping: the force of an indentation at 1 m/s is 1 + this times that at rest
    """,
    Key("thickness_mm", float, 6e-3, low=0.1, high=100.0),
    Key("stiffness_n_per_mm", float, 10e3, low=0.1, high=10_000.0),
    Key("depths_mm", list, (), low=0.0, high=100.0),
    Key("forces_n", list, (), low=0.0, high=100_000.0),
    Key("spread", float, 0.15, low=0.0, high=0.9),
    Key("hard_n_per_mm", float, 1e6, low=1.0, high=100_000.0),
    Key("loss_s_per_m", float, 0.3, low=0.0, high=10.0),
)

# ---- what arm.speed_limit_from stands for; ``coneskin permissible`` writes it

SPEED_LIMIT_KEYS = with_meanings(
    """
    digest: hash of all that follows: a file that was cut, or changed by hand, is refused
    fingerprint: hash of arm, sheets, padding and reactions that the speeds hold for
    date: when they were computed, UTC
    coneskin: the version that did
    edition: document and edition that the limits of the force are from
    transcribed_by: who copied them from it
    verified_by: who compared them with it
    measured_by: what measured reaction time and deceleration
    reaction_ms: from the closing of the layers until the arm brakes
    deceleration_rad_s2: of the leading joint then
    lowest_deg: joint positions from which on a patch's curve holds
    highest_deg: joint positions up to which it does
    levers_mm: speed of a patch over that of the leading joint, for a rad, rising
    curve: the curves, each under `[[speed_limit.curve]]`
    patch: the patches, each under `[[speed_limit.patch]]`
    """,
    Key("digest", str),
    Key("fingerprint", str),
    Key("date", str),
    Key("coneskin", str),
    Key("edition", str),
    Key("transcribed_by", str),
    Key("verified_by", str),
    Key("measured_by", str),
    Key("reaction_ms", low=0.0, high=1000.0),
    Key("deceleration_rad_s2", low=0.1, high=100.0),
    Key("lowest_deg", list, (), low=-363.0, high=363.0),
    Key("highest_deg", list, (), low=-363.0, high=363.0),
    Key("levers_mm", list, low=0.1, high=10_000.0),
    Key("curve", dict),
    Key("patch", dict),
)
CURVE_KEYS = with_meanings(
    """
    region: region of the body that limits
    mass_kg: heaviest mass of the arm that it holds for
    lag_mm: largest lag that it holds for, of a rad
    bend_mm: largest bend that it holds for, of a rad2
    speeds_mm_s: permissible speed for each lever
    """,
    Key("region", str),
    Key("mass_kg", float, None, low=0.0, high=1e6, unset="any"),
    Key("lag_mm", float, 0.0, low=0.0, high=1e5),
    Key("bend_mm", float, 0.0, low=0.0, high=1e5),
    Key("speeds_mm_s", list, low=0.0, high=10_000.0),
)
PATCH_KEYS = with_meanings(
    """
    sensor: name of the sensor
    u_mm: slant distance from end 1
    phi_deg: azimuth
    curve: number of its curve, from 0
    any_curve: number of the curve for any joint positions
    """,
    Key("sensor", str),
    Key("u_mm", low=0.0, high=10_000.0),
    Key("phi_deg", low=0.0, high=360.001),
    Key("curve", int, low=0, high=MAX_ROWS),
    Key("any_curve", int, low=0, high=MAX_ROWS),
)
