"""What your tests may use, and nothing else: a scene, and the contracts of a source and of an arm's driver.

scene = commissioned(parse_scene(forearm_scene(reaction='kind = "retreat"')))     # from coneskin.testing.scenes
for check in SOURCE_CHECKS:                                             # from coneskin.testing.source_contract
    check(open_my_source)
for check in ARM_CHECKS:                                                   # from coneskin.testing.arm_contract
    check(open_my_arm)
"""
