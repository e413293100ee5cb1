#include "datasets/inspection/inspection_page.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>

#include "core/error.h"
#include "datasets/inspection/contact_sheet.h"
#include "datasets/inspection/page_parts.h"
#include "datasets/inspection/truth_overlay.h"
#include "datasets/jobs/scenes_folder.h"
#include "datasets/sets/run_identity.h"
#include "plots/histogram_plot.h"
#include "plots/line_plot.h"
#include "sim/files/image_file.h"

namespace touchstone::datasets {
namespace {

constexpr std::size_t kMostPoints = 300;  // of a curve
constexpr std::size_t kMostCurves = 6;

// What the page does with three.js: turns the model that stands in it as base64 into a view to be turned by mouse.
constexpr const char* kViewerCode = R"(
(function () {
  "use strict";
  const place = document.getElementById("view");
  const probe = document.createElement("canvas");
  if (!(probe.getContext("webgl") || probe.getContext("experimental-webgl"))) {
    place.textContent = "This browser shows no WebGL.";
    return;
  }
  const text = atob(document.getElementById("model").textContent.trim());
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  const renderer = new THREE.WebGLRenderer({antialias: true});
  renderer.setPixelRatio(window.devicePixelRatio || 1);
  renderer.gammaOutput = true;
  renderer.setClearColor(0xeeeeff);
  place.appendChild(renderer.domElement);
  const scene = new THREE.Scene();
  scene.add(new THREE.HemisphereLight(0xffffff, 0x666666, 0.55));
  const lamp = new THREE.DirectionalLight(0xffffff, 0.5);
  lamp.position.set(1, 2, 1.5);
  scene.add(lamp);
  const camera = new THREE.PerspectiveCamera(35, 1, 0.001, 10);
  const controls = new THREE.OrbitControls(camera, renderer.domElement);
  function draw() { renderer.render(scene, camera); }
  function fit() {
    renderer.setSize(place.clientWidth, place.clientHeight);
    camera.aspect = place.clientWidth / place.clientHeight;
    camera.updateProjectionMatrix();
    draw();
  }
  new THREE.GLTFLoader().parse(bytes.buffer, "", function (model) {
    model.scene.traverse(function (part) {
      if (!part.isMesh) return;
      part.material.side = THREE.DoubleSide;
      // What is in contact lies on the object's own face: without this the two are seen in speckles.
      if (part.name.replace(/_/g, " ") === "gel in contact") {
        part.material.polygonOffset = true;
        part.material.polygonOffsetFactor = part.material.polygonOffsetUnits = -4;
      }
    });
    scene.add(model.scene);
    const ball = new THREE.Box3().setFromObject(model.scene).getBoundingSphere(new THREE.Sphere());
    controls.target.copy(ball.center);
    camera.near = 0.05 * ball.radius;
    camera.far = 20 * ball.radius;
    camera.position.copy(ball.center).add(new THREE.Vector3(0.6, 0.7, 1).setLength(3.4 * ball.radius));
    controls.update();
    controls.addEventListener("change", draw);
    window.addEventListener("resize", fit);
    fit();
    place.setAttribute("data-ready", "yes");
  }, function (error) { place.textContent = "The model can't be shown: " + error; });
})();
)";

std::string force_words(const InspectedSample& sample) {
  return fmt::format("{:.2f} {:.2f} {:.2f} N", sample.wrench[0], sample.wrench[1], sample.wrench[2]);
}

std::string sheet(const InspectedSet& set, const InspectionOptions& options) {
  const std::size_t scenes = std::max<std::size_t>(1, set.scenes.size());
  const std::size_t each = std::clamp<std::size_t>(static_cast<std::size_t>(options.most_tiles) / scenes, 1,
                                                   static_cast<std::size_t>(options.tiles_per_scene));
  std::vector<std::size_t> shown;
  for (const InspectedScene& scene : set.scenes) {
    for (const std::size_t i :
         spread_over(static_cast<std::size_t>(scene.first_sample), static_cast<std::size_t>(scene.samples), each)) {
      shown.push_back(i);
    }
  }
  // More scenes than tiles: some of them.
  const auto most = static_cast<std::size_t>(options.most_tiles);
  if (shown.size() > most) {
    std::vector<std::size_t> some;
    for (const std::size_t i : spread_over(0, shown.size(), most)) some.push_back(shown[i]);
    shown = some;
  }
  std::vector<cv::Mat> pictures;
  std::vector<std::string> captions;
  for (const std::size_t i : shown) {
    cv::Mat picture = inspected_frame(set, i);
    if (picture.empty()) continue;
    pictures.push_back(std::move(picture));
    captions.push_back(set.name_of_sample(i) + "\n" + force_words(set.samples[i]));
  }
  if (pictures.empty()) return "<p class=\"note\">The set has no frames.</p>\n";
  return picture_element(
      contact_sheet(pictures, captions, options.columns, options.tile_width),
      fmt::format("{} of {} frames, with the force x, y, z on the object", pictures.size(), set.samples.size()));
}

std::string histograms(const InspectedSet& set) {
  std::map<std::string, plots::HistogramPlot> plots;
  std::vector<std::string> order;
  const auto add = [&](const std::string& title, const std::string& unit, double value) {
    const auto [at, is_new] = plots.try_emplace(title, plots::HistogramPlot{title, unit, {}});
    if (is_new) order.push_back(title);
    at->second.values.push_back(value);
  };
  for (const InspectedSample& sample : set.samples) {
    for (int axis = 0; axis < 3; ++axis) add(fmt::format("force {}", "xyz"[axis]), "N", sample.wrench[axis]);
    for (int axis = 0; axis < 3; ++axis) add(fmt::format("torque {}", "xyz"[axis]), "N mm", sample.wrench[3 + axis]);
    for (int axis = 0; axis < 3; ++axis) {
      add(fmt::format("object's {}", "xyz"[axis]), "mm", sample.gel_from_object.translation[axis]);
    }
    const Eigen::Vector3d up = sample.gel_from_object.rotation.col(2);
    add("object's tilt", "degrees", std::acos(std::clamp(up.z(), -1.0, 1.0)) * 180.0 / CV_PI);
    add("contact", "mm\xC2\xB2", sample.contact_area);
    add("largest strain", "1", sample.largest_strain);
  }
  std::string html;
  for (const std::string& title : order) html += "<figure>" + plots::to_svg(plots.at(title)) + "</figure>\n";
  return html;
}

std::string force_curves(const InspectedSet& set) {
  plots::LinePlot plot{"normal force over each scene", "frame", "N", false, false, {}};
  for (const std::size_t k : spread_over(0, set.scenes.size(), kMostCurves)) {
    const InspectedScene& scene = set.scenes[k];
    plots::PlotCurve curve{scene.name, {}};
    for (const std::size_t i : spread_over(static_cast<std::size_t>(scene.first_sample),
                                           static_cast<std::size_t>(scene.samples), kMostPoints)) {
      curve.points.emplace_back(set.samples[i].frame, set.samples[i].wrench[2]);
    }
    plot.curves.push_back(std::move(curve));
  }
  return "<figure>" + plots::to_svg(plot) + "</figure>\n";
}

std::string error_bars(const InspectedSet& set) {
  plots::HistogramPlot absolute{"standard error of force z", "N", {}};
  plots::HistogramPlot relative{"the same, of the force", "%", {}};
  plots::HistogramPlot surface{"standard error of the surface", "mm", {}};
  std::int64_t under_resolved = 0;
  std::int64_t touching = 0;
  for (const InspectedSample& sample : set.samples) {
    if (sample.contact_area <= 0.0) continue;
    ++touching;
    under_resolved += sample.under_resolved ? 1 : 0;
    absolute.values.push_back(sample.force_error.z());
    relative.values.push_back(100.0 * sample.force_error.z() / std::abs(sample.wrench[2]));
    surface.values.push_back(sample.displacement_error);
  }
  std::string html = fmt::format(
      "<p class=\"note\">Of the {} samples in contact; {} of them are under-resolved. One standard error, from the "
      "mesh "
      "alone: not in it is what linear elasticity leaves out of large strains.</p>\n",
      touching, under_resolved);
  for (const plots::HistogramPlot* plot : {&absolute, &relative, &surface}) {
    if (set.drawn && plot == &surface) continue;  // it doesn't say
    html += "<figure>" + plots::to_svg(*plot) + "</figure>\n";
  }
  return html;
}

/// Of each scene, or of some of them, the sample that is pressed hardest.
std::vector<std::size_t> hardest(const InspectedSet& set, int most) {
  std::vector<std::size_t> chosen;
  for (const std::size_t k : spread_over(0, set.scenes.size(), static_cast<std::size_t>(most))) {
    const InspectedScene& scene = set.scenes[k];
    auto best = static_cast<std::size_t>(scene.first_sample);
    for (std::int64_t i = 0; i < scene.samples; ++i) {
      const auto at = static_cast<std::size_t>(scene.first_sample + i);
      if (set.samples[at].wrench.head<3>().norm() > set.samples[best].wrench.head<3>().norm()) best = at;
    }
    if (scene.samples > 0) chosen.push_back(best);
  }
  return chosen;
}

const PreparedScene* scene_of_sample(const std::optional<PreparedJob>& job, const InspectedSample& sample) {
  if (!job || sample.scene >= static_cast<int>(job->scenes.size())) return nullptr;
  return &job->scenes[static_cast<std::size_t>(sample.scene)];
}

/// The device that a drawn set carries or that the job names; null if it isn't known.
const sim::DeviceSpec* device_of_sample(const InspectedSet& set, const std::optional<PreparedJob>& job,
                                        const InspectedSample& sample) {
  if (set.drawn) return set.scenes[static_cast<std::size_t>(sample.scene)].device_spec.get();
  const PreparedScene* scene = scene_of_sample(job, sample);
  return scene == nullptr ? nullptr : &scene->spec.device;
}

/// @param shown samples
std::string overlays(const InspectedSet& set, const std::optional<PreparedJob>& job,
                     const std::vector<std::size_t>& shown, double arrow_px_per_N) {
  std::string html;
  for (const std::size_t i : shown) {
    const cv::Mat picture = inspected_frame(set, i);
    if (picture.empty()) continue;
    const InspectedSample& sample = set.samples[i];
    std::optional<GelView> view;
    if (const sim::DeviceSpec* device = device_of_sample(set, job, sample); device != nullptr && device->camera) {
      view.emplace(*device);
    }
    html += picture_element(
        draw_truth(picture, sample, read_inspected_gel(set, i), view, inspected_contact(set, i), arrow_px_per_N),
        fmt::format("{}: {} \xC2\xB1 {:.2g} N, {:.3g} mm\xC2\xB2 in contact", set.name_of_sample(i),
                    force_words(sample), sample.force_error.norm(), sample.contact_area));
  }
  return html.empty() ? "<p class=\"note\">The set has no frames.</p>\n" : html;
}

std::string plans(const InspectedSet& set) {
  // Scenes with the same effects share a table, whose reasons are those of the first of them.
  struct Effects {
    std::string names, rows, scenes;
  };
  std::vector<Effects> tables;
  for (const InspectedScene& scene : set.scenes) {
    Effects effects{{}, {}, scene.name};
    for (const sim::Effect& effect : scene.plan) {
      effects.names += effect.name + (effect.on ? " on\n" : " off\n");
      effects.rows += fmt::format("<tr{}>{}{}{}{}</tr>\n", effect.on ? "" : " class=\"off\"", cell(effect.name),
                                  cell(effect.on ? "on" : "off"), cell(effect.why), cell(effect.cost));
    }
    const auto known =
        std::find_if(tables.begin(), tables.end(), [&](const Effects& other) { return other.names == effects.names; });
    if (known == tables.end()) {
      tables.push_back(std::move(effects));
    } else {
      known->scenes += ", " + scene.name;
    }
  }
  std::string html = "<p class=\"note\">Figures in the reasons are those of the first scene named.</p>\n";
  for (const Effects& one : tables) {
    html +=
        fmt::format("<h3>{}</h3>\n", plots::escape_markup(one.scenes)) + table({"effect", "", "why", "cost"}, one.rows);
  }
  return html;
}

std::string scene_table(const InspectedSet& set) {
  std::string rows;
  for (const InspectedScene& scene : set.scenes) {
    std::string outputs, light;
    for (const std::string& output : scene.outputs) outputs += (outputs.empty() ? "" : ", ") + output;
    for (const auto& [how, samples] : scene.light)
      light += fmt::format("{}{}: {}", light.empty() ? "" : "; ", samples, how);
    rows += "<tr>" + cell(scene.name) + cell(scene.split) + number_cell(static_cast<double>(scene.samples)) +
            cell(scene.device) + cell(scene.object) + cell(outputs) + cell(light) + "</tr>\n";
  }
  return table({"", "split", "samples", "device", "object", "outputs", "light"}, rows);
}

/// What distinguishes a drawn set's sensors.
std::string unit_table(const InspectedSet& set) {
  if (set.scenes.empty() || set.scenes.front().drawn.empty()) {
    return "<p class=\"note\">All sensors are the same.</p>\n";
  }
  const auto& first = set.scenes.front().drawn;
  std::vector<std::string> head = {""};
  std::string rows;
  if (first.size() > set.scenes.size()) {
    // What there is more of stands in rows: a page has more of them than columns.
    for (const InspectedScene& scene : set.scenes) head.push_back(scene.name);
    for (std::size_t k = 0; k < first.size(); ++k) {
      rows += "<tr>" + cell(first[k].first);
      for (const InspectedScene& scene : set.scenes) rows += number_cell(scene.drawn.at(k).second);
      rows += "</tr>\n";
    }
  } else {
    for (const auto& [path, value] : first) head.push_back(path);
    for (const InspectedScene& scene : set.scenes) {
      rows += "<tr>" + cell(scene.name);
      for (const auto& [path, value] : scene.drawn) rows += number_cell(value);
      rows += "</tr>\n";
    }
  }
  return table(head, rows);
}

std::string timing_table(const InspectedSet& set) {
  if (set.timings.empty()) return "<p class=\"note\">The set was made without timings.</p>\n";
  std::string rows;
  for (const auto& [stage, seconds] : set.timings) rows += "<tr>" + cell(stage) + number_cell(seconds) + "</tr>\n";
  return table({"stage", "wall seconds"}, rows);
}

std::string array_table(const InspectedSet& set) {
  std::string rows;
  for (const auto& [path, axes, unit] : set.arrays) rows += "<tr>" + cell(path) + cell(axes) + cell(unit) + "</tr>\n";
  return table({"array", "axes", "unit"}, rows);
}

std::string view_3d(const InspectedSet& set, const std::optional<PreparedJob>& job,
                    const std::optional<ViewerScripts>& viewer) {
  if (!viewer) {
    return "<p class=\"note\">This touchstone was built without three.js (Debian: libjs-three), so there is no 3D "
           "view; "
           "<code>touchstone render --gltf</code> writes a scene's frame for any viewer.</p>\n";
  }
  if (set.samples.empty()) return "<p class=\"note\">The set has no samples.</p>\n";
  std::size_t best = 0;
  for (std::size_t i = 1; i < set.samples.size(); ++i) {
    if (set.samples[i].wrench.head<3>().norm() > set.samples[best].wrench.head<3>().norm()) best = i;
  }
  const InspectedSample& sample = set.samples[best];
  const InspectedGel gel = read_inspected_gel(set, best);
  if (gel.triangles.empty()) return "<p class=\"note\">The set doesn't hold the gel's surface.</p>\n";
  const std::string model = sim::glb_bytes(sample_parts(sample, gel, scene_of_sample(job, sample)), {});
  std::string html = fmt::format(
      "<p class=\"note\">{}, {}: what touches the gel is red, the arrow is the force on the object{}; drag turns it, "
      "the "
      "wheel zooms.</p>\n<div id=\"view\"></div>\n<script type=\"application/base64\" id=\"model\">{}</script>\n",
      plots::escape_markup(set.name_of_sample(best)), force_words(sample),
      set.drawn ? "; the surface is the part that the camera sees, from its height map, without the object" : "",
      base64(model));
  html += "<!-- three.js (https://threejs.org), MIT licence, Copyright (c) 2010-2019 three.js authors -->\n";
  for (const std::string* script : {&viewer->three, &viewer->gltf_loader, &viewer->orbit_controls}) {
    html += "<script>\n" + *script + "\n</script>\n";
  }
  return html + "<script>" + kViewerCode + "</script>\n";
}

}  // namespace

std::optional<PreparedJob> job_of_set(const InspectedSet& set, const std::filesystem::path& given, std::string& note) {
  std::filesystem::path file = given;
  if (file.empty()) {
    file = scenes_folder() / "jobs" / std::filesystem::path(set.job_file).filename();
    if (!std::filesystem::is_regular_file(file)) {
      note = "the job's file isn't known (--job names it), so the device's camera isn't";
      return std::nullopt;
    }
  }
  try {
    PreparedJob job = prepare_job(file);
    const RunIdentity identity = identity_of(job);
    if (identity.job_sha256 == set.job_sha256 && identity.inputs_sha256 == set.inputs_sha256) return job;
    const char* what = identity.job_sha256 == set.job_sha256 ? "what the job names isn't" : "it isn't the job";
    if (!given.empty()) fail("--job {}: {} that this set was made of", file.string(), what);
    note = fmt::format("{}: {} that this set was made of (--job names it), so the device's camera isn't known",
                       file.string(), what);
  } catch (const Error& error) {
    if (!given.empty()) throw;
    note = fmt::format("{}: can't be read ({}), so the device's camera isn't known", file.string(), error.what());
  }
  return std::nullopt;
}

std::string inspection_page(const InspectedSet& set, const std::optional<PreparedJob>& job, const std::string& note,
                            const std::optional<ViewerScripts>& viewer, const InspectionOptions& options) {
  std::string html = page_begin(set.job_name);
  html += fmt::format(
      "<p class=\"note\">{} samples in {} {}, {} files, {:.1f} MB. touchstone {} on {}. Content SHA-256 {}</p>\n",
      set.samples.size(), set.scenes.size(), set.drawn ? "units" : "scenes", set.files,
      static_cast<double>(set.bytes) / 1e6, plots::escape_markup(set.version), plots::escape_markup(set.processor),
      plots::escape_markup(set.content_sha256));
  const auto section = [&](const char* name, const std::string& content) {
    html += fmt::format("<h2>{}</h2>\n", name) + content;
  };
  section(set.drawn ? "Sensors" : "Scenes", scene_table(set));
  if (set.drawn) section("What was drawn for each sensor", unit_table(set));
  section("Frames", sheet(set, options));
  const std::vector<std::size_t> shown = hardest(set, options.most_overlays);
  std::vector<InspectedSample> drawn_over;
  for (const std::size_t i : shown) drawn_over.push_back(set.samples[i]);
  const double arrow_px_per_N = arrow_scale_px_per_N(drawn_over);
  std::string legend = fmt::format(
      "<p class=\"note\">Of each scene or sensor, or of some of them, the sample pressed hardest. Red: a cross where "
      "the object's origin is, and an arrow for the force along the gel on the object, {:.3g} px a newton; green: the "
      "contact's rim, of a set without a layer of it from the gel's mesh, to half an edge; blue: the beads' centres.",
      arrow_px_per_N);
  if (!note.empty()) legend += " Less is drawn: " + plots::escape_markup(note) + ".";
  section("Truth over frames", legend + "</p>\n" + overlays(set, job, shown, arrow_px_per_N));
  section("Forces and poses", (set.drawn ? "" : force_curves(set)) + histograms(set));
  section("Error bars", error_bars(set));
  section("3D", view_3d(set, job, viewer));
  if (!set.drawn) {
    section("Plan of effects", plans(set));
    section("Timings", timing_table(set));
  }
  section(set.drawn ? "Arrays of each block" : "Arrays of truth.h5", array_table(set));
  section("Job", "<pre>" + plots::escape_markup(set.job_text) + "</pre>\n");
  return html + page_end();
}

}  // namespace touchstone::datasets
