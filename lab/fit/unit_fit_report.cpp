// The files of a unit's fit.

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/edited_yaml.h"
#include "core/error.h"
#include "core/whole_file.h"
#include "datasets/inspection/contact_sheet.h"
#include "lab/fit/fit_folder.h"
#include "lab/fit/recorded_balls.h"
#include "lab/fit/unit_fit.h"
#include "sim/files/image_file.h"

namespace touchstone::lab {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDifference = 10.0;  // how much differences are enlarged
constexpr int kTileWidth_px = 320;

const char* name_of(UnknownHow how) {
  return how == UnknownHow::times ? "times" : "plus";
}

std::string interval_text(const FittedUnknown& unknown) {
  if (!unknown.identified) return "not identified";
  return fmt::format("{:.5g} to {:.5g}", unknown.low95, unknown.high95);
}

/// Standard errors as people read them: of a factor in percent.
std::string error_text(const FittedUnknown& unknown, double deviation) {
  if (!std::isfinite(deviation)) return "-";
  return unknown.how == UnknownHow::times ? fmt::format("{:.2g} %", 100.0 * deviation)
                                          : fmt::format("{:.2g}", deviation);
}

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

cv::Mat eight_bits(const cv::Mat& picture, double factor, double offset) {
  cv::Mat out;
  picture.convertTo(out, CV_8U, factor, offset);
  return out;
}

}  // namespace

std::vector<std::string> doubts_of(const PreparedFit& fit, const UnitFit& result) {
  std::vector<std::string> doubts = fit.spec.doubts;
  if (!result.converged) doubts.emplace_back("the fit hasn't converged: take its intervals with care");
  for (const FittedUnknown& unknown : result.unknowns) {
    if (!unknown.at_end) continue;
    doubts.push_back(
        fmt::format("{}: {:.5g} is an end of its allowed range; a wider one may fit better, or the device's file "
                    "is wrong elsewhere",
                    unknown.name, unknown.value));
  }
  for (std::size_t i = 0; i < result.presses.size(); ++i) {
    const FittedPress& press = result.presses[i];
    const std::string name = fit.spec.presses[i].picture.filename().string();
    if (press.depth_at_end) {
      doubts.push_back(
          fmt::format("{}: its depth, {:.4g} mm, is an end of what its label and deepest_mm ({:.4g} mm) allow", name,
                      press.depth_mm, fit.deepest_mm));
    }
    if (press.place_at_end) {
      doubts.push_back(fmt::format("{}: its place, ({:.4g}, {:.4g}) mm, is an end of what its label allows", name,
                                   press.x_mm, press.y_mm));
    }
  }
  return doubts;
}

std::string to_markdown(const PreparedFit& fit, const UnitFit& result) {
  std::string text = fmt::format(
      "# {}\n\nThe device {} fitted to {} presses{}: {} numbers of blocks of {} x {} pixels, {} steps, {}.\n\n"
      "Misfit before {:.2f}, after {:.2f} (root mean square, in standard deviations of the imager's and the labels' "
      "noise; 1 is a model without fault).\n\n",
      fit.spec.name, fit.device.name, fit.spec.presses.size(),
      fit.spec.backgrounds.empty() ? "" : fmt::format(" and {} pictures of rest", fit.spec.backgrounds.size()),
      result.residuals, fit.spec.coarse_px, fit.spec.coarse_px, result.steps,
      result.converged ? "converged" : "NOT CONVERGED: take the intervals with care", result.misfit_before,
      result.misfit_after);
  text +=
      "| unknown | start | fitted | 95 % interval | standard error | by noise | by the model | by the light | by the "
      "mesh |\n"
      "|---|---|---|---|---|---|---|---|---|\n";
  for (const FittedUnknown& unknown : result.unknowns) {
    text += fmt::format("| `{}` | {:.5g} | {:.5g}{} | {} | {} | {} | {} | {} | {} |\n", unknown.name, unknown.start,
                        unknown.value, unknown.at_end ? " (end of its range)" : "", interval_text(unknown),
                        error_text(unknown, unknown.deviation), error_text(unknown, unknown.by_noise),
                        error_text(unknown, unknown.by_model), error_text(unknown, unknown.by_light),
                        error_text(unknown, unknown.by_mesh));
  }
  text +=
      "\nOf numbers that go together the first stands for all. By noise: with the misfit's own size; by the model: by "
      "leaving out one part of the picture after the other; the larger of the two counts. By the light: with other "
      "random "
      "numbers for the simulated light; by the mesh: what the gel's mesh makes of forces. The interval is of all "
      "together.\n";
  text += "\n## What the data can't identify\n\n";
  if (result.unidentified.empty()) text += "Nothing: each unknown's interval is narrower than its allowed range.\n";
  for (const UnidentifiableCombination& combination : result.unidentified)
    text += fmt::format("- {}\n", combination.words);
  if (!result.unidentified.empty()) {
    text +=
        "\nOf these unknowns the fitted device has one choice of many that show the same. Give one of them a known "
        "value, "
        "or leave it out of `unknowns`.\n";
  }
  text += "\n## Doubts\n\n";
  if (result.doubts.empty()) text += "None: it has converged, and nothing stands at an end of what was allowed.\n";
  for (const std::string& doubt : result.doubts) text += "- " + doubt + "\n";
  text +=
      "\n## Misfit\n\n| what | before | after | before | after |\n|---|---|---|---|---|\n| | of the noise | of the "
      "noise | "
      "of 255, or N | of 255, or N |\n";
  for (const FitMisfit& misfit : result.misfits) {
    text += fmt::format("| {} | {:.2f} | {:.2f} | {:.3g} | {:.3g} |\n", misfit.what, misfit.before, misfit.after,
                        misfit.before_numbers, misfit.after_numbers);
  }
  text += "\n## Presses\n\n| press | x mm | y mm | depth mm | force N (simulated) |\n|---|---|---|---|---|\n";
  for (std::size_t i = 0; i < result.presses.size(); ++i) {
    const FittedPress& press = result.presses[i];
    const auto with = [](double value, double deviation) {
      return deviation > 0.0 ? fmt::format("{:.4f} +- {:.4f}", value, deviation) : fmt::format("{:.4g}", value);
    };
    text += fmt::format("| {} | {} | {} | {} | {:.4g} |\n", i, with(press.x_mm, press.place_deviation_mm),
                        with(press.y_mm, press.place_deviation_mm), with(press.depth_mm, press.depth_deviation_mm),
                        press.force_N);
  }
  return text;
}

std::string to_json(const PreparedFit& fit, const UnitFit& result, const datasets::RunIdentity& made_of) {
  Json all = {
      {"name", fit.spec.name},
      {"device", fit.device.name},
      {"residuals", result.residuals},
      {"steps", result.steps},
      {"converged", result.converged},
      {"misfit_before", number(result.misfit_before)},
      {"misfit_after", number(result.misfit_after)},
      {"made_of",
       {{"fit_sha256", made_of.job_sha256}, {"inputs_sha256", made_of.inputs_sha256}, {"version", made_of.version}}}};
  all["unknowns"] = Json::array();
  for (const FittedUnknown& unknown : result.unknowns) {
    all["unknowns"].push_back({{"name", unknown.name},
                               {"how", name_of(unknown.how)},
                               {"start", number(unknown.start)},
                               {"fitted", number(unknown.value)},
                               {"identified", unknown.identified},
                               {"low95", unknown.identified ? number(unknown.low95) : Json(nullptr)},
                               {"high95", unknown.identified ? number(unknown.high95) : Json(nullptr)},
                               {"standard_error", number(unknown.deviation)},
                               {"by_noise", number(unknown.by_noise)},
                               {"by_model", number(unknown.by_model)},
                               {"by_light", number(unknown.by_light)},
                               {"by_mesh", number(unknown.by_mesh)},
                               {"at_end", unknown.at_end}});
  }
  all["unidentified"] = Json::array();
  for (const UnidentifiableCombination& combination : result.unidentified) {
    Json parts = Json::array();
    for (const auto& part : combination.parts) {
      parts.push_back({{"name", part.name}, {"how", name_of(part.how)}, {"move", number(part.move)}});
    }
    all["unidentified"].push_back({{"words", combination.words}, {"parts", parts}});
  }
  all["misfits"] = Json::array();
  for (const FitMisfit& misfit : result.misfits) {
    all["misfits"].push_back({{"what", misfit.what},
                              {"before", number(misfit.before)},
                              {"after", number(misfit.after)},
                              {"before_numbers", number(misfit.before_numbers)},
                              {"after_numbers", number(misfit.after_numbers)}});
  }
  all["doubts"] = result.doubts;
  all["presses"] = Json::array();
  for (const FittedPress& press : result.presses) {
    all["presses"].push_back({{"place_mm", {press.x_mm, press.y_mm}},
                              {"place_standard_error_mm", number(press.place_deviation_mm)},
                              {"depth_mm", number(press.depth_mm)},
                              {"depth_standard_error_mm", number(press.depth_deviation_mm)},
                              {"place_at_end", press.place_at_end},
                              {"depth_at_end", press.depth_at_end},
                              {"simulated_force_N", number(press.force_N)}});
  }
  return all.dump(1) + "\n";
}

cv::Mat misfit_sheet(const UnitRecording& recording, const UnitFit& result) {
  std::vector<const BlockPicture*> recorded;
  if (!recording.background.mean.empty()) recorded.push_back(&recording.background);
  for (const BlockPicture& press : recording.presses) recorded.push_back(&press);
  TS_ASSERT(recorded.size() == result.shown.size());
  std::vector<cv::Mat> images;
  std::vector<std::string> captions;
  for (std::size_t i = 0; i < recorded.size(); ++i) {
    images.push_back(eight_bits(recorded[i]->mean, 1.0, 0.0));
    images.push_back(eight_bits(result.shown[i], 1.0, 0.0));
    images.push_back(eight_bits(result.shown[i] - recorded[i]->mean, kDifference, 128.0));
    captions.push_back(std::filesystem::path(recorded[i]->file).filename().string());
    captions.push_back("simulated");
    captions.push_back(fmt::format("simulated - recorded, x {:.0f}", kDifference));
  }
  return datasets::contact_sheet(images, captions, 3, kTileWidth_px);
}

UnitFitRun run_unit_fit(const std::filesystem::path& file, const std::filesystem::path& folder,
                        const std::filesystem::path& cache_folder, const Progress& progress,
                        const std::function<void(const FitPlan& plan)>& on_plan) {
  const auto asked = read_yaml<UnitFitSpec>(file);
  UnitFitRun run;
  FitFolder place(folder, asked.name, identity_of_fit(file, asked.recording));  // before minutes of work
  run.was_finished = place.is_finished();
  if (run.was_finished) return run;
  const PreparedFit fit = prepare_fit(with_recording(asked, cache_folder, progress));
  const UnitRecording recording = read_recording(fit);
  FitCourse course;
  course.on_plan = on_plan;
  const auto write_device = [&](const char* ending, const std::string& text) {
    write_whole_file(place.file(ending), with_yaml_files_from(text, asked.device.parent_path(), folder));
  };
  course.on_step = [&](int, double, const std::string& text) { write_device(".so-far.yaml", text); };
  course.keep = [&](const FitSoFar& so_far) { place.keep(so_far); };
  course.from = place.so_far();
  if (course.from) run.gone_on_from = course.from->search.steps;
  run.fit = fit_unit(fit, recording, cache_folder, progress, course);
  write_whole_file(place.file(".md"), to_markdown(fit, run.fit));
  write_device(".yaml", run.fit.device_text);
  sim::write_png(place.file(".png"), misfit_sheet(recording, run.fit));
  write_whole_file(place.file(".json"), to_json(fit, run.fit, place.identity()));  // the last: with it all is there
  std::filesystem::remove(place.file(".so-far.yaml"));
  place.finish();
  return run;
}

}  // namespace touchstone::lab
