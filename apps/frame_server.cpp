#include "apps/frame_server.h"

#include <sys/socket.h>

#include "apps/listening_server.h"

namespace touchstone::apps {
namespace {

constexpr int kThreads = 40;             // what streams and commands leave over answers the rest
constexpr int kSendBuffer = 256 * 1024;  // old frames that wait for a slow client

void set_socket(int socket) {
  ListeningServer::keep_port(socket);
  setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer);
}

}  // namespace

struct FrameServer::Parts {
  Parts(ServedCamera& shown, FramePages::Contents contents, double patience_s)
      : camera(shown), pages(shown, std::move(contents)), server(kThreads, patience_s) {
    server.set_socket_options(&set_socket);
    pages.add_to(server);
  }

  ServedCamera& camera;
  FramePages pages;
  ListeningServer server;
};

FrameServer::FrameServer(ServedCamera& camera, FramePages::Contents contents, const Settings& how)
    : parts_(std::make_unique<Parts>(camera, std::move(contents), how.patience_s)) {
  parts_->server.begin(how.address, how.port, {"", "another --port may be free, --port 0 takes any"});
}

FrameServer::~FrameServer() {
  parts_->camera.stop();
  parts_->server.end();
}

int FrameServer::port() const {
  return parts_->server.port();
}

}  // namespace touchstone::apps
