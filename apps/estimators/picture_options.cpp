#include "apps/estimators/picture_options.h"

namespace touchstone::apps {

std::shared_ptr<PictureOptions> add_picture_options(CLI::App& command) {
  auto options = std::make_shared<PictureOptions>();
  CLI::Option* const live = command
                                .add_option_function<int>(
                                    "--live",
                                    [options](int port) {
                                      options->live = true;
                                      options->port = port;
                                    },
                                    "Show each frame with what is estimated of it, to a browser on this machine: "
                                    "--live 8080; 0: any free port")
                                ->type_name("PORT");
  live->check(CLI::Range(0, 65535));
  command.add_option("--video", options->video, "A video of these pictures: an .mp4 file")->type_name("FILE");
  return options;
}

}  // namespace touchstone::apps
