"""What your tests may use, and nothing else: the contracts of a source and of an arm's driver.

for check in SOURCE_CHECKS:                                             # from coneskin.testing.source_contract
    check(open_my_source)
for check in ARM_CHECKS:                                                   # from coneskin.testing.arm_contract
    check(open_my_arm)
"""
