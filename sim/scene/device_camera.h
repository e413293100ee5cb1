#pragma once
// From a device file's camera to the renderer's.

#include "render/cameras/camera.h"
#include "sim/scene/device.h"

namespace touchstone::sim {

/// Where the camera stands and looks.
RigidTransform pose_of(const CameraSpec& camera);

/// A camera with a hole, as the renderer takes it. @pre its optics are a PinholeSpec
render::PinholeCamera pinhole_camera(const CameraSpec& camera);

/// The pinhole or the lens of a device. @throws Error if a lens can't be made: it can't focus so near, or its
/// distortion can't be inverted inside the picture
render::Camera camera_of(const CameraSpec& camera);

/// A device's hole or stop as diffraction takes it, for light of these wavelengths. What a hole looks at is the gel's
/// outer face, at its apparent depth along z (air, plate and gel, each over its index). @pre the device has a camera
render::DiffractingAperture aperture_of(const DeviceSpec& device, const render::Spectrum& wavelengths_nm);

/// camera_of() with diffraction. @throws Error as that @pre as DiffractionSpread
render::Camera diffracting_camera(const DeviceSpec& device, const render::Spectrum& wavelengths_nm);

/// The diameter in pixels of the disc to which a point at `distance_mm` before the camera is blurred by hole or lens.
double blur_disc_px(const render::Camera& camera, double distance_mm);

/// The largest radius in pixels of the disc to which a point of the scene, from `nearest_mm` before the camera to
/// any distance, is blurred by hole or lens.
double blur_radius_px(const render::Camera& camera, double nearest_mm);

/// Radius that a sharp point's image has at least, pixels: 0 with a lens; behind a hole that of a point far away in the
/// picture's corner, where the foil's thickness hides a part of the hole.
double least_blur_radius_px(const render::Camera& camera);

}  // namespace touchstone::sim
