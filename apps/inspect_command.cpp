#include <algorithm>
#include <memory>

#include "apps/command.h"
#include "apps/viewer_scripts.h"
#include "core/error.h"
#include "core/whole_file.h"
#include "datasets/inspection/contact_sheet.h"
#include "datasets/inspection/estimate_page.h"
#include "datasets/inspection/inspected_draw.h"
#include "datasets/inspection/inspection_page.h"
#include "datasets/inspection/page_parts.h"
#include "datasets/sources/frame_sequence.h"
#include "sim/files/image_file.h"

namespace touchstone::apps {
namespace {

struct InspectOptions {
  std::filesystem::path data;
  std::filesystem::path out;
  std::filesystem::path job;
  std::filesystem::path overlay;
  int columns = 6;
  int tiles_per_scene = 6;
  int tile_width = 240;
};

void write_page(const InspectOptions& options) {
  const datasets::InspectedSet set = datasets::read_inspected_set(options.data);
  std::string note;
  std::optional<datasets::PreparedJob> job;
  if (!set.drawn) {
    job = datasets::job_of_set(set, options.job, note);
  } else if (!options.job.empty()) {
    fail("--job: isn't for a set that was drawn; it has its devices in it");
  } else if (std::ranges::any_of(set.scenes, [](const auto& unit) { return unit.device_spec == nullptr; })) {
    note = "the units' device files name others that aren't here, so their cameras aren't known";
  }
  datasets::InspectionOptions how;
  how.columns = options.columns;
  how.tiles_per_scene = options.tiles_per_scene;
  how.tile_width = options.tile_width;
  write_whole_file(options.out, datasets::inspection_page(set, job, note, viewer_scripts(), how));
  fmt::print("{}: {} samples in {} {}{}\n", options.out.string(), set.samples.size(), set.scenes.size(),
             set.drawn ? "units" : "scenes", note.empty() ? "" : "; " + note);
}

void add_frames_of_scenes(const InspectOptions& options, std::vector<cv::Mat>& pictures,
                          std::vector<std::string>& captions) {
  for (const datasets::FrameSequence& sequence : datasets::frames_of_data_set(options.data, std::nullopt)) {
    for (const std::size_t i :
         datasets::spread_over(0, sequence.frames.size(), static_cast<std::size_t>(options.tiles_per_scene))) {
      const datasets::LabelledFrame& frame = sequence.frames[i];
      pictures.push_back(sim::read_image(frame.file));
      captions.push_back(fmt::format("{} {}\n{:.2f} {:.2f} {:.2f} N", sequence.name, frame.frame, frame.force->x(),
                                     frame.force->y(), frame.force->z()));
    }
  }
}

void add_frames_of_units(const InspectOptions& options, std::vector<cv::Mat>& pictures,
                         std::vector<std::string>& captions) {
  const datasets::InspectedSet set = datasets::read_inspected_set(options.data);
  for (const datasets::InspectedScene& unit : set.scenes) {
    const auto each = static_cast<std::size_t>(options.tiles_per_scene);
    for (const std::size_t i : datasets::spread_over(0, static_cast<std::size_t>(unit.samples), each)) {
      const std::size_t sample = static_cast<std::size_t>(unit.first_sample) + i;
      pictures.push_back(datasets::inspected_frame(set, sample));
      if (pictures.back().empty()) fail("{}: has no frames", options.data.string());
      const auto& force = set.samples[sample].wrench;
      captions.push_back(
          fmt::format("{}\n{:.2f} {:.2f} {:.2f} N", set.name_of_sample(sample), force[0], force[1], force[2]));
    }
  }
}

void write_sheet(const InspectOptions& options) {
  if (!options.job.empty()) fail("--job: is for a page, and {} is a picture", options.out.string());
  std::vector<cv::Mat> pictures;
  std::vector<std::string> captions;
  datasets::read_manifest(options.data).source == datasets::SetSource::draw
      ? add_frames_of_units(options, pictures, captions)
      : add_frames_of_scenes(options, pictures, captions);
  sim::write_png(options.out, datasets::contact_sheet(pictures, captions, options.columns, options.tile_width));
  fmt::print("{}: {} frames with their forces x, y, z on the object\n", options.out.string(), pictures.size());
}

/// Is it what a `touchstone estimate` wrote, and no data set?
bool holds_estimates(const std::filesystem::path& place) {
  if (std::filesystem::is_directory(place)) return !std::filesystem::exists(place / "dataset.json");
  return place.extension() == ".csv";
}

void write_report(const InspectOptions& options) {
  if (options.out.extension() != ".html") fail("{}: the report of estimates is an .html file", options.out.string());
  if (!options.job.empty()) fail("--job: is for a data set, and {} holds estimates", options.data.string());
  const std::filesystem::path place = options.data.lexically_normal();
  const std::vector<datasets::EstimateTable> tables = datasets::estimate_tables(place);
  const bool is_folder = std::filesystem::is_directory(place);
  std::filesystem::path overlay = options.overlay;
  if (overlay.empty()) overlay = (is_folder ? place : place.parent_path()) / "overlay";
  const std::vector<std::filesystem::path> pictures = datasets::pictures_below(overlay);
  if (!options.overlay.empty() && pictures.empty()) fail("--overlay: {} holds no pictures", overlay.string());
  datasets::EstimatePageOptions how;
  how.tile_width = options.tile_width;
  const std::filesystem::path named = place.has_filename() ? place : place.parent_path();
  write_whole_file(options.out, datasets::estimate_page(named.filename().string(), tables, pictures, how));
  fmt::print("{}: {} table{}{}\n", options.out.string(), tables.size(), tables.size() == 1 ? "" : "s",
             pictures.empty() ? "" : fmt::format(", pictures of {}", overlay.string()));
}

void inspect(const InspectOptions& options) {
  require_writable_place(options.out);
  if (holds_estimates(options.data)) return write_report(options);
  if (!options.overlay.empty()) fail("--overlay: is for estimates, and {} is a data set", options.data.string());
  const auto ending = options.out.extension();
  if (ending != ".png" && ending != ".html") fail("{}: the name must end in .html or .png", options.out.string());
  ending == ".html" ? write_page(options) : write_sheet(options);
}

}  // namespace

void add_inspect_command(CLI::App& app, const GlobalOptions&, Action& action) {
  CLI::App* command = app.add_subcommand(
      "inspect",
      "Look at a data set: a page with frames, truth, histograms and a view in 3D, or a sheet of its frames; or at "
      "estimates: a report with curves, errors, contact and slip, doubtful frames");
  auto options = std::make_shared<InspectOptions>();
  command
      ->add_option("DIR", options->data,
                   "A data set that `touchstone generate` made; or a folder or .csv file that an "
                   "estimate wrote")
      ->required();
  command
      ->add_option("-o,--out", options->out,
                   "The page, an .html file that needs nothing else, or the sheet, a .png file")
      ->required();
  command->add_option("--job", options->job, "The job that the set was made of (default: the shipped one of its name)");
  command->add_option("--overlay", options->overlay,
                      "Of estimates: the folder of pictures to show (default: 'overlay' beside the tables)");
  command->add_option("--per-scene", options->tiles_per_scene, "Frames of each scene, spread evenly over it")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->add_option("--columns", options->columns, "Frames a row")->check(CLI::Range(1, 100))->capture_default_str();
  command->add_option("--tile-width", options->tile_width, "Of each frame, px")
      ->check(CLI::Range(32, 4096))
      ->capture_default_str();
  command->callback([&action, options] { action = [options] { inspect(*options); }; });
}

}  // namespace touchstone::apps
