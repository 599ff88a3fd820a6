"""Virtual Shutter: a shutter for every pixel, in Blender's Video Sequencer."""


def register():
    from .shutter_addon import blender

    blender.register()


def unregister():
    from .shutter_addon import blender

    blender.unregister()
