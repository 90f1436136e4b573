"""Table of all benches: name on the command line, module, and what its figures do not show."""

from __future__ import annotations

from dataclasses import dataclass

_SIMULATED_ARM = "No real arm or controller was measured."
_SIMULATED_SKIN = "No real skin was measured."


@dataclass(frozen=True)
class Bench:
    """One row of the table.

    Attributes:
        module: that has `main()`; the first line of its docstring says what it measures.
        not_shown: what the figures do not show.
        one_thread: numerical libraries are held to one thread, because their run times are compared.
    """

    module: str
    not_shown: str
    one_thread: bool = False


BENCHES = {
    # the guard's loop
    "loop": Bench("bench.loop.stages", "ur_rtde, the controller, the arm, a real serial adapter, a busy machine."),
    "compiled": Bench("bench.loop.compiled", "Ports, processes and the driver: inputs come from memory."),
    "exploration": Bench(
        "bench.loop.exploration",
        "States that differ in a time or a number only: of each abstract state one is followed.",
    ),
    "parts": Bench("bench.loop.parts", "State in dictionaries and lists that stay the same ones; what objects share."),
    "processes": Bench("bench.loop.processes", "A real controller, which sends as much, and a real port."),
    "busy": Bench("bench.loop.busy", "A real controller and a real skin, which this computer does not hold up."),
    "publish": Bench("bench.loop.publish", "Subscribers on another computer."),
    "start": Bench("bench.loop.start", "A real controller, and a port of a real skin."),
    "endurance": Bench("bench.loop.endurance", "Sockets, the disk and ur_rtde: frames come from memory."),
    # the reaction
    "reaction": Bench("bench.reaction.times", _SIMULATED_ARM),
    "retreat": Bench("bench.reaction.retreat", "Dynamics: the retreats are geometry alone."),
    "deceleration": Bench(
        "bench.reaction.deceleration", "Friction, which helps, and the brakes and limits of a real controller."
    ),
    "stopping-times": Bench(
        "bench.reaction.stopping_times", "Brakes: the law of the simulation is fitted to UR's tables."
    ),
    "kinematics": Bench("bench.reaction.kinematics", "The accuracy of a real arm's geometry."),
    "speed-limit": Bench("bench.reaction.speed_limit", "How soon a real controller's slider acts."),
    # faults, collisions, and the model of a contact
    "faults": Bench("bench.faults.campaign", _SIMULATED_ARM + " Each kind was tried a few times on a busy machine."),
    "push-in": Bench("bench.collision.push_in", "Forces: contacts are a stiff pad, and the arm obeys within bounds."),
    "collision": Bench(
        "bench.collision.newtons", "Forces that a person would bear: these figures compare ways to protect a body."
    ),
    "bare-sides": Bench("bench.collision.bare_sides", "Friction in the joints, and noise of their currents."),
    "collision-settled": Bench("bench.collision.settled", "A real controller may end such a motion first (C153)."),
    "impact-foams": Bench(
        "bench.impact.foams", "A real foam: how its force hangs on time, temperature and age.", one_thread=True
    ),
    "impact-agreement": Bench(
        "bench.impact.agreement", "Other links, other arms, and pushes by more than one joint: it bounds nothing."
    ),
    "impact-braking": Bench("bench.impact.braking", "Deceleration that a real arm with its payload cannot give."),
    "impact-integrators": Bench("bench.impact.integrators", "Whether the model of the contact is right."),
    "impact-masses": Bench("bench.impact.masses", "A bound: the positions compared with are a sample, too."),
    "impact-stability": Bench("bench.impact.stability", "Accuracy at each point of the grid."),
    "impact-study": Bench(
        "bench.impact.study", "The study's measurements: only its abstract and its spring and mass could be read."
    ),
    # the skin
    "wire": Bench("bench.skin.wire", "Ports, and the guard behind the detector."),
    "sources": Bench("bench.skin.sources", "Real ports: both are pseudo-terminals."),
    "virtual-skin": Bench("bench.skin.virtual_skin", _SIMULATED_SKIN),
    "as-built": Bench("bench.skin.as_built", "Wrinkles, worn foils, cold; contacts are discs."),
    "calibrate": Bench("bench.skin.calibrate", "What a finger and an uneven sheet add: contacts are points."),
    "decode": Bench("bench.decode.accuracy", _SIMULATED_SKIN + " Sheets are uniform.", one_thread=True),
    "decode-faults": Bench("bench.decode.faults", _SIMULATED_SKIN),
    "field": Bench(
        "bench.field.accuracy",
        "Uneven sheets, electrodes with a resistance of their own, contacts that bend the sheets.",
        one_thread=True,
    ),
    "field-extremes": Bench("bench.field.extremes", "Run time.", one_thread=True),
    "field-reference": Bench("bench.field.reference", "Solvers other than NGSolve."),
    "firmware": Bench("bench.firmware.timing", "Sample-and-hold and non-linearity of the converter; real hardware."),
    "board-spice": Bench("bench.firmware.board_spice", "Radio, stray inductance."),
    "boards": Bench("bench.firmware.boards", "Radio, discharges."),
    "firmware-guard": Bench("bench.firmware.guard", _SIMULATED_ARM + " The board is emulated."),
    # sheets for links
    "design-map": Bench("bench.design.map", "Links of other shapes."),
    "design-planted": Bench("bench.design.planted", "Real links: the truth is planted."),
    "design-copies": Bench("bench.design.copies", "Links of which a part is missing."),
    "design-room": Bench("bench.design.room", "Axes that the search never looks at."),
    "design-reach": Bench("bench.design.reach", "Whether a person would build each sheet."),
    "design-assembly": Bench(
        "bench.design.assembly", "Whether a person would build each sheet; poses in which an arm folds."
    ),
    "design-time": Bench("bench.design.time", "Pictures, and other links."),
    "developable": Bench("bench.design.developable", "Real links: the tubes are planted."),
    "developable-field": Bench("bench.design.developable_field", "A sheet that was built."),
    "build": Bench("bench.workshop.build", "Warp and shrinkage of a printer: nothing was printed."),
    "build-report": Bench("bench.workshop.report_check", "Whether a person can build from it: nobody has yet."),
    # the tests of all this
    "mutations": Bench("bench.mutations.campaign", "Whether a survivor is equivalent: a person has to look."),
    # recordings, the page, and the simulated controller
    "replay": Bench("bench.replay.recordings", "Damage that has a right checksum, and an idle machine."),
    "view": Bench("bench.view.page", "A GPU, or a browser on another computer: chromium drew in software."),
    "view-colors": Bench("bench.view.colors", "Eyes: they are simulated (Machado, Oliveira and Fernandes 2009)."),
    "view-hours": Bench("bench.view.hours", "A GPU."),
    "view-endurance": Bench("bench.view.endurance", "Browsers: nobody looks at the page."),
    "ur-clients": Bench("bench.clients.trials", "A real controller's answers to the same clients."),
    "ur-corpus": Bench("bench.clients.corpus", "What a real controller says of the same programs."),
    "sim-ur": Bench("bench.clients.sim_ur", _SIMULATED_ARM),
}
