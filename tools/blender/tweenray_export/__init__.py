"""Exports a Blender scene to tweenray: File, Export, tweenray. See docs/blender.md of tweenray.

Not done: what tweenray cannot express is named in report.txt beside the scene file, with what was done instead.
"""

bl_info = {
    "name": "tweenray",
    "description": "Export the scene and its camera move to tweenray",
    "author": "the authors of tweenray",
    "version": (0, 2, 0),
    "blender": (4, 2, 0),
    "location": "File > Export > tweenray",
    "category": "Import-Export",
}

import os

import bpy
from bpy_extras.io_utils import ExportHelper

from . import scene as scene_export


class ExportTweenray(bpy.types.Operator, ExportHelper):
    """Write scene.toml, meshes, textures and report.txt into a folder"""

    bl_idname = "export_scene.tweenray"
    bl_label = "Export tweenray"
    filename_ext = ".toml"
    filter_glob: bpy.props.StringProperty(default="*.toml", options={"HIDDEN"})

    def execute(self, context):
        """Exports to the folder of the chosen file."""
        folder = os.path.dirname(bpy.path.abspath(self.filepath))
        try:
            lines = scene_export.write(context.scene, folder)
        except (ValueError, OSError, RuntimeError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for line in lines:
            self.report({"WARNING"}, line)
        self.report({"INFO"}, f"wrote {os.path.join(folder, 'scene.toml')}; {len(lines)} notes in report.txt")
        return {"FINISHED"}

    def invoke(self, context, event):
        """Asks for a folder."""
        self.filepath = "scene.toml"
        return super().invoke(context, event)


def entry(menu, context):
    """The line of the Export menu."""
    menu.layout.operator(ExportTweenray.bl_idname, text="tweenray (scene.toml)")


def register():
    """Called by Blender when the add-on is switched on."""
    bpy.utils.register_class(ExportTweenray)
    bpy.types.TOPBAR_MT_file_export.append(entry)


def unregister():
    """Called by Blender when the add-on is switched off."""
    bpy.types.TOPBAR_MT_file_export.remove(entry)
    bpy.utils.unregister_class(ExportTweenray)
