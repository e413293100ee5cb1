#include <memory>
#include <optional>

#include "apps/command.h"
#include "apps/progress_bar.h"
#include "core/error.h"
#include "lab/marker_compliance_export.h"
#include "sensors/marker_compliance_file.h"
#include "sim/device.h"
#include "sim/virtual_sensor.h"

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

}  // namespace

void add_export_command(CLI::App& app, const GlobalOptions& global, Action& action) {
  CLI::App* exports = app.add_subcommand("export", "Write what estimators need to know of a device");
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
}

}  // namespace touchstone::apps
