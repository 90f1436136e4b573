"""Contract between a guard and the driver of an arm, independent of its maker: values, messages, protocols."""
