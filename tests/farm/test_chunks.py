"""The command's chunks, a process each, in any order."""

import random

from farm_job import FRAMES, shutter

CHUNKS = 4


def test_chunks_in_random_order_give_the_bits_of_one_process(job, single):
    length = FRAMES // CHUNKS
    for first in random.Random(1).sample(range(1, FRAMES, length), CHUNKS):
        chunk = f"{first}:{first + length - 1}"
        shutter("render", job.edit, "--output", job.pictures, "--frames", chunk, "--resume")
    shutter("join", job.pictures, "--edit", job.edit, "--output", job.movie)
    job.check(single)
