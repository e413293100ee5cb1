#include "bench/cycles_peer.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "bench/peer_process.h"
#include "core/error.h"
#include "core/whole_file.h"
#include "render/scene/spot_light.h"
#include "sim/files/image_file.h"

namespace touchstone::bench {
namespace {

constexpr const char* kBlender = "/usr/bin/blender";  // Debian's
constexpr double kSquareMillimetresPerSquareMetre = 1e6;

nlohmann::json triple(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}
nlohmann::json bands(const render::Spectrum& spectrum) {
  return {spectrum[0], spectrum[1], spectrum[2]};
}

nlohmann::json faces_of(const render::Scene& scene) {
  nlohmann::json faces = nlohmann::json::array();
  for (const render::FlatFace& face : scene.faces) {
    faces.push_back({{"z", face.z},
                     {"index_below", scene.media[static_cast<std::size_t>(face.medium_below)].index},
                     {"index_above", scene.media[static_cast<std::size_t>(face.medium_above)].index}});
  }
  return faces;
}

nlohmann::json surfaces_of(const render::Scene& scene) {
  nlohmann::json surfaces = nlohmann::json::array();
  for (const render::Surface& surface : scene.surfaces) {
    const auto* matt = std::get_if<render::Lambertian>(&surface.material);
    if (matt == nullptr || surface.print) fail("Cycles is given surfaces that are Lambertian and not printed on");
    nlohmann::json vertices = nlohmann::json::array();
    for (const Eigen::Vector3d& x : surface.mesh.vertices) vertices.push_back(triple(x));
    surfaces.push_back(
        {{"albedo", bands(matt->albedo)}, {"vertices", vertices}, {"triangles", surface.mesh.triangles}});
  }
  return surfaces;
}

nlohmann::json lamps_of(const render::Scene& scene) {
  nlohmann::json lamps = nlohmann::json::array();
  for (const render::Lamp& any : scene.lamps) {
    if (!std::holds_alternative<render::SpotLamp>(any)) fail("Cycles is given SpotLamps only");
    const auto& lamp = std::get<render::SpotLamp>(any);
    if (!(lamp.lens_radius > 0.0) || lamp.soft_angle != 0.0) {
      fail("Cycles is given lamps with a lens and a sharp rim; one has lens_radius {} mm and soft_angle {}",
           lamp.lens_radius, lamp.soft_angle);
    }
    lamps.push_back({{"position", triple(lamp.position)},
                     {"direction", triple(lamp.direction.normalized())},
                     {"radius", lamp.lens_radius},
                     {"half_angle", lamp.half_angle},
                     {"intensity", bands(lamp.power_W / render::spot_solid_angle(lamp))}});
  }
  return lamps;
}

void check_for_cycles(const render::Scene& scene) {
  render::check_scene(scene);
  if (scene.environment.size() != 3) fail("Cycles draws three bands; the scene has {}", scene.environment.size());
  if (scene.environment.maxCoeff() > 0.0) fail("Cycles is given dark surroundings only");
  if (!scene.balls.empty()) fail("Cycles is given meshes; the scene has {} balls", scene.balls.size());
  for (const render::Medium& medium : scene.media) {
    if (medium.absorption.size() > 0 || medium.scattering.size() > 0) fail("Cycles is given clear media only");
  }
}

nlohmann::json description(const render::Scene& scene, const render::PinholeCamera& camera,
                           const CyclesOptions& options) {
  check_for_cycles(scene);
  const Eigen::Matrix3d& turn = camera.gel_from_camera.rotation;
  return {{"threads", options.threads},
          {"most_bounces", options.most_bounces},
          {"most_matt_bounces", options.most_matt_bounces},
          {"shadow_caustics", options.shadow_caustics},
          {"faces", faces_of(scene)},
          {"surfaces", surfaces_of(scene)},
          {"lamps", lamps_of(scene)},
          {"camera",
           {{"width", camera.width},
            {"height", camera.height},
            {"pixel_mm", 1e-3 * camera.pixel_pitch_um},
            {"distance_mm", camera.distance_mm},
            {"position", triple(camera.gel_from_camera.translation)},
            {"rotation", {triple(turn.row(0)), triple(turn.row(1)), triple(turn.row(2))}}}}};
}

cv::Mat read_radiance(const std::filesystem::path& file) {
  const sim::LinearImage picture = sim::read_exr(file);
  if (picture.channel_names != std::vector<std::string>{"R", "G", "B"}) {
    fail("{}: its channels are {}; R, G, B were expected", file.string(), fmt::join(picture.channel_names, ", "));
  }
  cv::Mat radiance;
  picture.image.convertTo(radiance, CV_32FC3, kSquareMillimetresPerSquareMetre);  // Cycles' unit of length is our mm
  return radiance;
}

}  // namespace

std::string why_no_cycles() {
  if (probe({kBlender, "--version"}) == 0) return {};
  return fmt::format("{} doesn't run; script/bootstrap --bench installs Debian's blender", kBlender);
}

CyclesRun run_cycles(const render::Scene& scene, const render::PinholeCamera& camera, const CyclesOptions& options,
                     const std::vector<CyclesJob>& jobs, const std::filesystem::path& scratch) {
  const std::filesystem::path scene_file = scratch / "cycles-scene.json";
  const std::filesystem::path jobs_file = scratch / "cycles-jobs.json";
  const std::filesystem::path record_file = scratch / "cycles-record.json";
  const std::filesystem::path log = scratch / "cycles.log";
  const auto picture_file = [&](std::size_t k) { return scratch / fmt::format("cycles-{}.exr", k); };
  nlohmann::json wanted = nlohmann::json::array();
  for (std::size_t k = 0; k < jobs.size(); ++k) {
    wanted.push_back({{"seed", jobs[k].seed}, {"samples", jobs[k].samples}, {"out", picture_file(k).string()}});
  }
  write_whole_file(scene_file, description(scene, camera, options).dump());
  write_whole_file(jobs_file, wanted.dump());
  std::filesystem::remove(record_file);
  const int code = run_to_end({kBlender, "-b", "--factory-startup", "-noaudio", "--python-exit-code", "1", "-P",
                               std::string(TOUCHSTONE_SOURCE_DIR) + "/bench/cycles_scene.py", "--", scene_file.string(),
                               jobs_file.string(), record_file.string()},
                              log);
  if (code != 0 || !std::filesystem::exists(record_file)) {
    fail("Cycles ended with {}: {}", code, read_whole_file(log));
  }
  const nlohmann::json record = nlohmann::json::parse(read_whole_file(record_file));
  CyclesRun run;
  run.version = record.at("version").get<std::string>();
  run.overhead_seconds = record.at("overhead_seconds").get<double>();
  const double overhead_processor = record.at("overhead_processor_seconds").get<double>();
  for (std::size_t k = 0; k < jobs.size(); ++k) {
    const nlohmann::json& picture = record.at("pictures").at(k);
    run.pictures.push_back({read_radiance(picture_file(k)),
                            std::max(1e-6, picture.at("seconds").get<double>() - run.overhead_seconds),
                            std::max(1e-6, picture.at("processor_seconds").get<double>() - overhead_processor)});
    std::filesystem::remove(picture_file(k));
  }
  return run;
}

}  // namespace touchstone::bench
