"""Table of all benches: name on the command line -> module."""

from __future__ import annotations

__all__ = ["BENCHES"]

BENCHES = {
    # the guard's loop
    "loop": "bench.loop.stages",
    "publish": "bench.loop.publish",
    "start": "bench.loop.start",
    "endurance": "bench.loop.endurance",
    # the reaction
    "reaction": "bench.reaction.times",
    "stops": "bench.reaction.stops",
    "retreat": "bench.reaction.retreat",
    "deceleration": "bench.reaction.deceleration",
    "kinematics": "bench.reaction.kinematics",
    "speed-limit": "bench.reaction.speed_limit",
    # faults, alone and two at once
    "faults": "bench.faults.campaign",
    # collisions, in virtual time and in the physics engine
    "push-in": "bench.collision.push_in",
    "collision": "bench.collision.newtons",
    "collision-settled": "bench.collision.settled",
    "collision-saturated": "bench.collision.saturated",
    # the model of a contact
    "impact-agreement": "bench.impact.agreement",
    "impact-braking": "bench.impact.braking",
    "impact-integrators": "bench.impact.integrators",
    "impact-masses": "bench.impact.masses",
    "impact-stability": "bench.impact.stability",
    "impact-study": "bench.impact.study",
    # the skin
    "wire": "bench.skin.wire",
    "sources": "bench.skin.sources",
    "skins": "bench.skin.skins",
    "virtual-skin": "bench.skin.virtual_skin",
    "calibrate": "bench.skin.calibrate",
    "decode": "bench.decode.accuracy",
    "decode-faults": "bench.decode.faults",
    "field": "bench.field.accuracy",
    "field-extremes": "bench.field.extremes",
    "field-reference": "bench.field.reference",
    "firmware": "bench.firmware.timing",
    "firmware-guard": "bench.firmware.guard",
    # sheets for links
    "design": "bench.design.error",
    "design-planted": "bench.design.planted",
    "design-links": "bench.design.links",
    "design-reach": "bench.design.reach",
    "design-time": "bench.design.time",
    "developable": "bench.design.developable",
    "developable-field": "bench.design.developable_field",
    "build": "bench.workshop.build",
    "build-report": "bench.workshop.report_check",
    # recordings, the page, and the simulated controller
    "replay": "bench.replay.recordings",
    "replay-cluster": "bench.replay.cluster",
    "view": "bench.view.page",
    "view-hours": "bench.view.hours",
    "view-endurance": "bench.view.endurance",
    "ur-clients": "bench.clients.trials",
    "sim-ur": "bench.clients.sim_ur",
}
