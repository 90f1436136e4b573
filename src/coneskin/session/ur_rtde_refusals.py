"""Methods of ur_rtde that a guarded program cannot have: each with the reason, and with what to do instead."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

__all__ = ["REFUSALS"]

_BY_HAND = "use it in a program without the guard, or guard a program on the controller with control = external"
_COMPLIES = (
    "in it the arm moves with what pushes it, so that a stop of the guard cannot be told from it by measured speed; "
    + _BY_HAND
)
_PROGRAMS = (
    "a program on the controller would replace the one that the guard stops; run it with control = external, where the "
    "guard stops whatever runs"
)
_WATCHDOG = "the driver process keeps the controller's watchdog (arm.watchdog_hz); leave the call out"
_CONTACT = "a touch that the controller notices by its motors' currents comes long after the skin's; leave the call out"
_RESTART = (
    "a connection that is gone has stopped the arm, and a person has to look: end the session and start a new one"
)
_RECORDING = (
    "the session records all that it hears; for more, use an RTDEReceiveInterface beside the guard: it only reads"
)

#: name in ur_rtde -> why it is refused, and what to do
REFUSALS: Mapping[str, str] = MappingProxyType(
    {
        "movePath": "its Path is an object of the wheel that cannot be read: call move_path with a list of cs.Waypoint",
        "servoC": "the wheel's own program loses what follows it, a stop included: use servoL, or moveL with blends",
        "moveUntilContact": "it moves until something is hit: call speedL in a loop, and read getActualTCPForce",
        "jogStart": "it moves on without an end if the program hangs: call speedL in a loop",
        "jogStop": "there is no jogging to stop: call stop",
        "directTorque": f"it moves the arm by torques alone; {_COMPLIES}",
        "forceMode": _COMPLIES,
        "forceModeStop": "there is no force mode to stop: leave the call out",
        "forceModeSetDamping": "there is no force mode to set up: leave the call out",
        "forceModeSetGainScaling": "there is no force mode to set up: leave the call out",
        "freedriveMode": _COMPLIES,
        "endFreedriveMode": "there is no freedrive to end: leave the call out",
        "getFreedriveStatus": "there is no freedrive: leave the call out",
        "teachMode": _COMPLIES,
        "endTeachMode": "there is no teach mode to end: leave the call out",
        "startContactDetection": _CONTACT,
        "stopContactDetection": _CONTACT,
        "readContactDetection": _CONTACT,
        "toolContact": _CONTACT,
        "zeroFtSensor": f"it changes what the controller's own safety system may rely on; {_BY_HAND}",
        "enableExternalFtSensor": f"it changes what the controller's own safety system may rely on; {_BY_HAND}",
        "ftRtdeInputEnable": f"it changes what the controller's own safety system may rely on; {_BY_HAND}",
        "setExternalForceTorque": f"it changes what the controller's own safety system may rely on; {_BY_HAND}",
        "setGravity": "it follows from how the arm is mounted: set it in the controller's installation",
        "setTargetPayload": "it changes the payload while the arm moves: call setPayload while it stands",
        "setSpeedSlider": "the slider is a stop path of the guard: scale the speeds of the program",
        "setWatchdog": _WATCHDOG,
        "kickWatchdog": _WATCHDOG,
        "triggerProtectiveStop": "only a person can unlock one: call stop, or end the session",
        "sendCustomScript": _PROGRAMS,
        "sendCustomScriptFile": _PROGRAMS,
        "sendCustomScriptFunction": _PROGRAMS,
        "setCustomScriptFile": _PROGRAMS,
        "reuploadScript": f"after a stop session.reset() starts it, because a person has looked; {_PROGRAMS}",
        "reconnect": _RESTART,
        "startFileRecording": _RECORDING,
        "stopFileRecording": _RECORDING,
        "unlockProtectiveStop": "no protective stop is ever unlocked by a program: a person does it on the pendant",
    }
)
