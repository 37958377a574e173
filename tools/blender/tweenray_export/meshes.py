"""Evaluated meshes as binary PLY files, one a material, each written once however often it is placed."""

import hashlib
import os

import numpy as np

POSITION = ["x", "y", "z"]


class Meshes:
    """The PLY files of an export, in the folder `meshes` of `folder`."""

    def __init__(self, folder, materials, report):
        self.folder, self.materials, self.report = folder, materials, report
        self._parts, self._files, self._names = {}, {}, set()

    def parts(self, instance, depsgraph):
        """[(file, material slot's material or None)] of a depsgraph instance's object."""
        ob = instance.object
        # By themselves: those of libraries may have the names of others.
        slots = tuple(slot.material.original if slot.material else None for slot in ob.material_slots)
        data = ob.data
        key = (data.as_pointer(), slots) if ob.type == "MESH" else (ob.original.as_pointer(), slots)
        if key not in self._parts:
            mesh = data if ob.type == "MESH" else ob.to_mesh()
            self._parts[key] = self._write(ob, mesh, slots)
            if ob.type != "MESH":
                ob.to_mesh_clear()
        return self._parts[key]

    def _write(self, ob, mesh, slots):
        if mesh is None or not len(mesh.polygons):
            return []
        mesh.calc_loop_triangles()
        count = len(mesh.loop_triangles)
        loops = whole(mesh.loop_triangles, "loops", 3 * count).reshape(count, 3)
        used = whole(mesh.loop_triangles, "material_index", count)
        used = np.clip(used, 0, max(len(slots) - 1, 0))
        found = []
        for index in np.unique(used):
            material = self._material(mesh, slots, index)
            rows = self._corners(ob, mesh, material)[loops[used == index].reshape(-1)]
            name = f"{ob.data.name if ob.data else ob.name}-{material.name}" if material else ob.name
            found.append((self._file(name, rows, self._heads(mesh, material)), material))
        return found

    def _material(self, mesh, slots, index):
        material = slots[index] if index < len(slots) else None
        if material is None and index < len(mesh.materials) and mesh.materials[index]:
            material = mesh.materials[index].original
        return material

    def _uv_layers(self, mesh, material):
        """The UV maps that the material names, the active one in place of any that the mesh lacks."""
        layers = mesh.uv_layers
        active = next((layer for layer in layers if layer.active_render), None)
        if active is None:
            for name in self.materials.uv_maps(material):
                if name:
                    self.report.add(mesh.name, f"the UV map {name}, {lacking(mesh, name)}", "no texture coordinates: its images show one colour")
            return []
        names = self.materials.uv_maps(material)
        for name in names:
            if name and name not in layers:
                self.report.add(mesh.name, f"the UV map {name}, {lacking(mesh, name)}", "its active one")
        return [layers.get(name, active) if name else active for name in names]

    def _colours(self, mesh, material):
        wanted = self.materials.colour_attribute(material)
        if wanted is None:
            return None
        attributes = mesh.color_attributes
        name = wanted or attributes.default_color_name or ""
        found = attributes.get(name)
        if found is None:
            what = f"the colour attribute {name}, {lacking(mesh, name)}" if name else "a colour attribute, which it has not"
            self.report.add(mesh.name, what, "white" if name in mesh.attributes else "white, where Cycles has black")
        return found

    def _heads(self, mesh, material):
        """Names of what `_corners` gives: position, normal, sets of texture coordinates, colour."""
        heads = POSITION + ["nx", "ny", "nz"]
        for number in range(len(self._uv_layers(mesh, material))):
            heads += [f"{axis}{number or ''}" for axis in "st"]
        return heads + (["red", "green", "blue"] if self._colours(mesh, material) is not None else [])

    def _corners(self, ob, mesh, material):
        """One row of f32 a corner of a face: all that it has, in Blender's axes."""
        corners = len(mesh.loops)
        vertex = whole(mesh.loops, "vertex_index", corners)
        columns = [floats(mesh.vertices, "co", len(mesh.vertices), 3)[vertex]]
        columns.append(floats(mesh.corner_normals, "vector", corners, 3))
        colours = self._colours(mesh, material)
        for layer in self._uv_layers(mesh, material):
            columns.append(floats(layer.uv, "vector", corners, 2))
        if colours is not None:
            linear = floats(colours.data, "color", len(colours.data), 4)[:, :3]
            codes = to_srgb(linear)
            columns.append(codes if colours.domain == "CORNER" else codes[vertex])
        rows = np.concatenate(columns, axis=1, dtype=np.float32)
        if not np.isfinite(rows).all():
            self.report.add(ob.name, "numbers that are not finite", "0 in their place")
            rows = np.nan_to_num(rows, nan=0.0, posinf=0.0, neginf=0.0)
        return rows + np.float32(0.0)

    def _file(self, name, rows, heads):
        """The name of the file of triangles whose corners are `rows`, written where no other has its bytes."""
        unique, index = unique_rows(rows)
        body = ply(unique, heads, index.reshape(-1, 3))
        digest = hashlib.sha256(body).digest()
        if digest not in self._files:
            file = "meshes/" + free_name(name, self._names) + ".ply"
            os.makedirs(os.path.join(self.folder, "meshes"), exist_ok=True)
            with open(os.path.join(self.folder, file), "wb") as out:
                out.write(body)
            self._files[digest] = file
        return self._files[digest]

    def quads(self, name, corners):
        """The file of flat quads, each of four corners in Blender's axes."""
        points = np.array(corners, dtype=np.float32).reshape(-1, 3)
        first = 4 * np.arange(len(corners))[:, None]
        triangles = np.concatenate([first + [0, 1, 2], first + [0, 2, 3]], axis=1).reshape(-1)
        return self._file(name, points[triangles], POSITION)


def lacking(mesh, name):
    """Why the attribute of that name is not what a material wants it for."""
    found = mesh.attributes.get(name)
    return f"which is {found.data_type} of the domain {found.domain}" if found else "which it has not"


def whole(items, name, count):
    """A property of whole numbers of each item."""
    values = np.empty(count, dtype=np.int32)
    items.foreach_get(name, values)
    return values


def floats(items, name, count, width):
    """A property of `width` numbers of each item."""
    values = np.empty(count * width, dtype=np.float32)
    items.foreach_get(name, values)
    return values.reshape(count, width)


def unique_rows(rows):
    """The different rows in the order in which they first come, and which of them each row is."""
    raw = np.ascontiguousarray(rows).view(np.dtype((np.void, rows.dtype.itemsize * rows.shape[1]))).reshape(-1)
    _, first, index = np.unique(raw, return_index=True, return_inverse=True)
    order = np.argsort(first)
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return rows[first[order]], place[index.reshape(-1)]


def ply(vertices, heads, triangles):
    """The bytes of a binary PLY file."""
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property float {head}" for head in heads]
    lines += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header\n"]
    faces = np.empty(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, triangles
    return "\n".join(lines).encode() + vertices.astype("<f4").tobytes() + faces.tobytes()


def to_srgb(linear):
    """Codes from 0 to 1 of linear light (IEC 61966-2-1)."""
    x = np.clip(linear.astype(np.float64), 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1.0 / 2.4) - 0.055)


def free_name(name, taken):
    """`name` with letters that every file system has, and a number where it is taken."""
    safe = "".join(c if c.isascii() and (c.isalnum() or c in "-_.") else "_" for c in name)[:80].strip(".") or "unnamed"
    number, found = 1, safe
    while found.lower() in taken:
        number += 1
        found = f"{safe}-{number}"
    taken.add(found.lower())
    return found
