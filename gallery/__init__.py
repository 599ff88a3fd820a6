"""The figures of the paper made again: footage, recipes and stills; `scripts/gallery NAME` makes one."""

NAMES = (
    *("pendulum", "sphere", "displacement", "bunny", "hands", "crowd", "rolling_shutter", "rolling_repair"),
    *("light_trails", "empty_street", "one_stroke", "handheld", "panning", "sped_up", "time_map", "object_matte"),
)
