"""What the tests of your own program may use, and nothing else: a scene to try it with, and the contract of a source.

scene = commissioned(parse_scene(forearm_scene(reaction='kind = "retreat"')))     # from coneskin.testing.scenes
for check in SOURCE_CHECKS:                                             # from coneskin.testing.source_contract
    check(open_my_source)
"""
