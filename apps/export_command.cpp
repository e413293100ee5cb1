#include <algorithm>
#include <memory>
#include <optional>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "core/error.h"
#include "core/whole_file.h"
#include "datasets/exports/estimate_hdf5.h"
#include "datasets/inspection/estimate_page.h"
#include "datasets/sets/run_identity.h"
#include "lab/press/marker_compliance_export.h"
#include "sensors/events/event_file.h"
#include "sensors/tractions/marker_compliance_file.h"
#include "sim/press/gel_setup.h"
#include "sim/scene/device.h"

namespace touchstone::apps {
namespace {

struct ComplianceOptions {
  std::filesystem::path device;
  std::filesystem::path out;
  std::optional<double> patch_mm;
};

void export_compliance(const ComplianceOptions& options, const GlobalOptions& global) {
  require_writable_place(options.out);
  const sim::DeviceSpec device = sim::read_device(options.device);
  lab::check_marker_compliance(device);  // before minutes of set-up
  std::shared_ptr<const fem::Compliance> gel;
  {
    ProgressBar bar(global.quiet);
    gel = sim::set_up_gel(device, global.cache, bar.listener());
  }
  const sensors::MarkerCompliance compliance = lab::export_marker_compliance(device, *gel, options.patch_mm);
  sensors::save(compliance, options.out);
  fmt::print("{}: {} x {} markers under tractions on {} x {} patches of {:.3f} mm\n", options.out.string(),
             compliance.marker_grid.x(), compliance.marker_grid.y(), compliance.patch_grid.x(),
             compliance.patch_grid.y(), compliance.patch_side);
}

struct EventOptions {
  std::filesystem::path in;
  std::filesystem::path out;
  int width = 0;
  int height = 0;
  std::optional<int> stream;
};

/// The camera's size is the file's own or the one given, else that which the events themselves reach.
cv::Size size_of(const EventOptions& options, const sensors::EventReadOptions& how) {
  sensors::EventReader reader(options.in, how);
  if (reader.source().size) return *reader.source().size;
  cv::Size size(1, 1);
  for (auto portion = reader.next(); !portion.empty(); portion = reader.next()) {
    for (const Event& event : portion) {
      size.width = std::max(size.width, event.x + 1);
      size.height = std::max(size.height, event.y + 1);
    }
    if (reader.source().size) return *reader.source().size;
  }
  return size;
}

void export_events(const EventOptions& options) {
  sensors::event_format_of_name(options.out);
  require_writable_place(options.out);
  if (std::error_code none; std::filesystem::equivalent(options.in, options.out, none)) {
    fail("{}: would be written over while it is read", options.out.string());
  }
  sensors::EventReadOptions how;
  how.stream = options.stream;
  if ((options.width > 0) != (options.height > 0)) fail("--width and --height: give both or none");
  if (options.width > 0) how.size = cv::Size(options.width, options.height);
  const cv::Size size = size_of(options, how);
  sensors::EventReader reader(options.in, how);
  write_whole_file(options.out, [&](const std::filesystem::path& temporary) {
    sensors::EventWriter writer(temporary, size, datasets::program_name());
    for (auto portion = reader.next(); !portion.empty(); portion = reader.next()) writer.append(portion);
    writer.close();
  });
  const sensors::EventSource& source = reader.source();
  fmt::print("{}: {} events of {} x {} pixels; left out: {} triggers, {} before the first time and row, {} others\n",
             options.out.string(), source.events, size.width, size.height, source.triggers, source.unplaced,
             source.others);
}

void add_events_command(CLI::App& exports, Action& action) {
  CLI::App* command = exports.add_subcommand(
      "events", "Events of a file in another format: .h5 (DSEC), .raw (EVT 3.0), .aedat4, .txt or .csv");
  auto options = std::make_shared<EventOptions>();
  command->add_option("IN", options->in, "File of events, a real camera's or a simulated one's")->required();
  command->add_option("-o,--out", options->out, "The file to write")->required();
  command->add_option("--width", options->width, "Columns of the camera, where the file doesn't say it")
      ->check(CLI::PositiveNumber);
  command->add_option("--height", options->height, "Rows of the camera")->check(CLI::PositiveNumber);
  command->add_option("--stream", options->stream, "Number of the stream, for .aedat4 files that have several");
  command->callback([&action, options] { action = [options] { export_events(*options); }; });
}

struct TableOptions {
  std::filesystem::path in;
  std::filesystem::path out;
};

void export_tables(const TableOptions& options) {
  require_writable_place(options.out);
  const std::vector<datasets::EstimateTable> tables = datasets::estimate_tables(options.in);
  datasets::write_hdf5(tables, options.out);
  fmt::print("{}:", options.out.string());
  for (const datasets::EstimateTable& table : tables) {
    fmt::print(" {} ({} columns, {} lines)", table.file.stem().string(), table.columns.size(), table.lines);
  }
  fmt::print("\n");
}

void add_tables_command(CLI::App& exports, Action& action) {
  CLI::App* command = exports.add_subcommand("tables", "Tables of estimates as one HDF5 file, with units");
  auto options = std::make_shared<TableOptions>();
  command
      ->add_option("ESTIMATES", options->in,
                   "What `touchstone estimate` wrote: its folder, or one of its tables (.csv)")
      ->required();
  command->add_option("-o,--out", options->out, "The file to write: .h5")->required();
  command->callback([&action, options] { action = [options] { export_tables(*options); }; });
}

}  // namespace

void add_export_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* exports = app.add_subcommand(
      "export", "Write what estimators need to know of a device, or events, estimates or a data set in another format");
  exports->require_subcommand(1);
  exports->fallthrough();
  CLI::App* command = exports->add_subcommand(
      "compliance", "How the gel's printed markers (or else its beads) move under tractions: for forces from markers");
  auto options = std::make_shared<ComplianceOptions>();
  command->add_option("--device", options->device, "Device file")->required();
  command->add_option("-o,--out", options->out, "The file to write")->required();
  command->add_option("--patch-mm", options->patch_mm,
                      "Side of the patches on which tractions are sought (default: half of the markers' spacing)");
  command->callback(
      [&action, &global, options] { action = [&global, options] { export_compliance(*options, global); }; });
  add_events_command(*exports, action);
  add_tables_command(*exports, action);
  add_webdataset_export(*exports, global, action);
}

}  // namespace touchstone::apps
