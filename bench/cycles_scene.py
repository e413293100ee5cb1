"""The same scene in Blender's Cycles (Debian's blender): the peer that bench_light_peer measures us against.

    blender -b --factory-startup -noaudio -P cycles_scene.py -- SCENE.json JOBS.json RECORD.json

SCENE.json is what cycles_peer.cpp writes of a render::Scene: flat faces between media, matt meshes, disc lamps and a
pinhole camera. JOBS.json is a list of pictures of it, {"seed", "samples", "out"}; each is written as an EXR of scene
linear radiance. RECORD.json gets the seconds of each. Everything that makes Cycles faster by being wrong is off: no
clamping, no blurred glossy light, no lamp left out for being dim, no adaptive sampling, no denoising. Lengths are mm.
"""

import json
import math
import sys
import time

import bpy
from mathutils import Matrix, Vector

FACE_HALF_WIDTH = 2000.0  # mm: our faces have no end


def new_material(name, shader, **inputs):
    """A material of one shader node."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    node = nodes.new(shader)
    for key, value in inputs.items():
        node.inputs[key].default_value = value
    output = nodes.new("ShaderNodeOutputMaterial")
    material.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def add_mesh(name, vertices, triangles, material):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], triangles)
    mesh.materials.append(material)
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(thing)
    return thing


def add_face(face, caustics):
    """A smooth boundary of two media. Its front looks down, so `IOR` is that of what lies above over what lies below."""
    ratio = face["index_above"] / face["index_below"]
    glass = new_material("glass", "ShaderNodeBsdfGlass", IOR=ratio, Roughness=0.0, Color=(1, 1, 1, 1))
    glass.node_tree.nodes["Glass BSDF"].distribution = "SHARP"
    w, z = FACE_HALF_WIDTH, face["z"]
    corners = [(-w, -w, z), (-w, w, z), (w, w, z), (w, -w, z)]
    thing = add_mesh("face", corners, [(0, 1, 2), (0, 2, 3)], glass)
    for polygon in thing.data.polygons:
        polygon.use_smooth = True  # what the caustics' solver asks for; flat all the same
    thing.cycles.is_caustics_caster = caustics


def add_matt(surface, caustics):
    matt = new_material("matt", "ShaderNodeBsdfDiffuse", Roughness=0.0, Color=(*surface["albedo"], 1))
    thing = add_mesh("membrane", surface["vertices"], surface["triangles"], matt)
    thing.cycles.is_caustics_receiver = caustics


def shape_lobe(light, cos_half_angle):
    """Makes the lamp's intensity the same in all directions of a cone: a radiance in proportion to 1 / cosine there."""
    light.use_nodes = True
    nodes, links = light.node_tree.nodes, light.node_tree.links
    place = nodes.new("ShaderNodeNewGeometry")
    cosine = nodes.new("ShaderNodeVectorMath")
    cosine.operation = "DOT_PRODUCT"
    links.new(place.outputs["Normal"], cosine.inputs[0])
    links.new(place.outputs["Incoming"], cosine.inputs[1])
    inside = nodes.new("ShaderNodeMath")
    inside.operation = "GREATER_THAN"
    links.new(cosine.outputs["Value"], inside.inputs[0])
    inside.inputs[1].default_value = cos_half_angle
    strength = nodes.new("ShaderNodeMath")
    strength.operation = "DIVIDE"
    links.new(inside.outputs[0], strength.inputs[0])
    links.new(cosine.outputs["Value"], strength.inputs[1])
    links.new(strength.outputs[0], nodes["Emission"].inputs["Strength"])


def add_lamp(lamp, caustics):
    light = bpy.data.lights.new("lamp", "AREA")
    light.shape = "DISK"
    light.size = 2.0 * lamp["radius"]
    light.spread = math.pi
    # Blender gives an area lamp of `energy` E and area A the radiance E / (4 A); ours has intensity / (A cosine).
    light.energy = 4.0 * max(lamp["intensity"])
    light.color = [band / max(lamp["intensity"]) for band in lamp["intensity"]]
    shape_lobe(light, math.cos(lamp["half_angle"]))
    light.cycles.use_multiple_importance_sampling = True
    light.cycles.is_caustics_light = caustics
    thing = bpy.data.objects.new("lamp", light)
    thing.matrix_world = Matrix.Translation(lamp["position"]) @ Vector(lamp["direction"]).to_track_quat(
        "-Z", "Y"
    ).to_matrix().to_4x4()
    thing.visible_camera = False
    bpy.context.collection.objects.link(thing)


def add_camera(camera, render):
    view = bpy.data.cameras.new("camera")
    view.type = "PERSP"
    view.sensor_fit = "HORIZONTAL"
    view.sensor_width = camera["width"] * camera["pixel_mm"]
    view.lens = camera["distance_mm"]
    view.clip_start, view.clip_end = 1e-3, 1e4
    thing = bpy.data.objects.new("camera", view)
    turn = Matrix(camera["rotation"])  # columns: right, down, forward; Blender's are right, up, backward
    turn = turn @ Matrix(((1, 0, 0), (0, -1, 0), (0, 0, -1)))
    thing.matrix_world = Matrix.Translation(camera["position"]) @ turn.to_4x4()
    bpy.context.collection.objects.link(thing)
    bpy.context.scene.camera = thing
    render.resolution_x, render.resolution_y = camera["width"], camera["height"]
    render.resolution_percentage = 100


def set_up_cycles(description):
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.world = bpy.data.worlds.new("dark")
    scene.world.color = (0, 0, 0)
    render = scene.render
    render.threads_mode, render.threads = "FIXED", description["threads"]
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_mode = "RGB"
    render.image_settings.color_depth = "32"
    render.image_settings.exr_codec = "NONE"
    scene.view_settings.view_transform = "Raw"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.light_sampling_threshold = 0.0
    cycles.blur_glossy = 0.0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.use_auto_tile = False
    # The default pattern of this version (PMJ) has points in common for all seeds: means then err by more than the seeds'
    # scatter shows.
    cycles.sampling_pattern = "SOBOL"
    cycles.max_bounces = cycles.glossy_bounces = cycles.transmission_bounces = description["most_bounces"]
    cycles.diffuse_bounces = description["most_matt_bounces"]
    return scene


def timed_render():
    """Seconds on the clock and of all processors."""
    clock, processor = time.perf_counter(), time.process_time()
    bpy.ops.render.render()
    return time.perf_counter() - clock, time.process_time() - processor


def main():
    scene_file, jobs_file, record_file = sys.argv[sys.argv.index("--") + 1 :]
    with open(scene_file, encoding="utf-8") as file:
        description = json.load(file)
    with open(jobs_file, encoding="utf-8") as file:
        jobs = json.load(file)
    for thing in list(bpy.data.objects):  # the start-up scene's cube, lamp and camera
        bpy.data.objects.remove(thing)
    caustics = description["shadow_caustics"]
    scene = set_up_cycles(description)
    for face in description["faces"]:
        add_face(face, caustics)
    for surface in description["surfaces"]:
        add_matt(surface, caustics)
    for lamp in description["lamps"]:
        add_lamp(lamp, caustics)
    add_camera(description["camera"], scene.render)

    # What a picture costs that isn't tracing: one of a single sample a pixel, the least of three after the first.
    scene.cycles.samples = 1
    timed_render()
    overhead = [min(figures) for figures in zip(*(timed_render() for _ in range(3)))]
    pictures = []
    for job in jobs:
        scene.cycles.samples, scene.cycles.seed = job["samples"], job["seed"]
        seconds, processor_seconds = timed_render()
        bpy.data.images["Render Result"].save_render(job["out"])
        pictures.append({"seconds": seconds, "processor_seconds": processor_seconds})
    record = {
        "version": bpy.app.version_string,
        "overhead_seconds": overhead[0],
        "overhead_processor_seconds": overhead[1],
        "pictures": pictures,
    }
    with open(record_file, "w", encoding="utf-8") as file:
        json.dump(record, file)


main()
