"""A Blender that has never seen the extension, and gets it from a zip."""

import os
import subprocess

# The extension's modules that a Blender of a distribution may have for its own Python, and an official one has not.
PACKAGES = ("av", "cv2", "glcontext", "moderngl", "tqdm")
INSTALL = ("--command", "extension", "install-file", "-r", "user_default", "-e")


def installed(blender, zip_file, user):
    """The folder of the extension, in a new folder of user files; blender: the command that runs it, as a list."""
    user.mkdir()
    environment = os.environ | {"BLENDER_USER_RESOURCES": str(user)}
    done = subprocess.run([*blender, *INSTALL, zip_file], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return user / "extensions" / "user_default" / "virtual_shutter"
