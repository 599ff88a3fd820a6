"""What takes long to load, loaded once: the processes of all inputs part from one that has it."""

import random
import sys

import av  # noqa: F401
import bpy  # noqa: F401
import cattrs  # noqa: F401
import cv2  # noqa: F401
import moderngl  # noqa: F401
import tqdm

from . import hostile, media, recipes  # noqa: F401

hostile.value(random.Random(0))  # Hypothesis makes tables when it is first used
tqdm.tqdm.get_lock()  # a semaphore, which processes that end in the midst of a render would leave behind
PATH = list(sys.path)  # with Blender's own modules
