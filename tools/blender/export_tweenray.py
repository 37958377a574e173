"""Exports a Blender scene to tweenray, without Blender's window.

    blender -b shot.blend -P tools/blender/export_tweenray.py -- out/
    python3 tools/blender/export_tweenray.py shot.blend out/        (a Python with the module bpy)

The add-on is the folder tweenray_export beside this file (docs/blender.md).
"""

import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))


def main(words):
    """Exports to the folder that `words` name, after opening a blend file if they name one. Gives the exit code."""
    import bpy

    from tweenray_export import scene

    files = [word for word in words if word.endswith(".blend")]
    folders = [word for word in words if not word.endswith(".blend")]
    if len(files) > 1 or len(folders) != 1 or folders[0].startswith("-"):
        asked = words in (["--help"], ["-h"])
        print(__doc__, file=sys.stdout if asked else sys.stderr)
        return 0 if asked else 2
    if not files and not bpy.data.filepath:
        print("export_tweenray: no scene is open: name a .blend", file=sys.stderr)
        return 2
    try:
        for file in files:
            bpy.ops.wm.open_mainfile(filepath=os.path.abspath(file))
        lines = scene.write(bpy.context.scene, os.path.abspath(folders[0]))
    except (ValueError, OSError, RuntimeError) as error:
        print(f"export_tweenray: {error}", file=sys.stderr)
        return 2
    for line in lines:
        print(f"export_tweenray: {line}", file=sys.stderr)
    print(os.path.join(folders[0], "scene.toml"))
    return 0


if __name__ == "__main__":
    own = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    code = main(own)
    # Blender goes on with its window otherwise, or ends with 0.
    sys.stdout.flush()
    sys.stderr.flush()
    sys.exit(code)
