#include "apps/estimators/live_options.h"

#include <fmt/format.h>

#include <cstdio>

namespace touchstone::apps {

std::shared_ptr<LiveOptions> add_live_options(CLI::App& command) {
  auto options = std::make_shared<LiveOptions>();
  CLI::Option* const live = command
                                .add_option_function<int>(
                                    "--live",
                                    [options](int port) {
                                      options->on = true;
                                      options->port = port;
                                    },
                                    "Show each frame with what is estimated of it, to a browser on this machine: "
                                    "--live 8080; 0: any free port")
                                ->type_name("PORT");
  live->check(CLI::Range(0, 65535));
  return options;
}

std::unique_ptr<LiveView> opened_view(const LiveOptions& options, const std::string& title) {
  if (!options.on) return nullptr;
  auto view = std::make_unique<LiveView>(title, options.port);
  fmt::print("live: http://127.0.0.1:{}/\n", view->port());
  std::fflush(stdout);
  return view;
}

std::function<void(const cv::Mat&)> shown_in(LiveView* view) {
  if (view == nullptr) return {};
  return [view](const cv::Mat& picture) { view->show(picture); };
}

}  // namespace touchstone::apps
