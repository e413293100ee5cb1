#pragma once

#include <string>
#include <thread>

#include "apps/whole_request_server.h"

namespace touchstone::apps {

/// A WholeRequestServer that listens at a port of its own, which no other server shares, in a thread of its own.
class ListeningServer : public WholeRequestServer {
 public:
  /// What an error says before and after "can't listen at ADDRESS:PORT: why".
  struct Words {
    std::string before, advice;
  };

  using WholeRequestServer::WholeRequestServer;

  /// Begins to listen. `port` 0 takes any that is free. @pre not called before @throws Error if it can't
  void begin(const std::string& address, int port, const Words& words);
  /// Stops, and waits for the thread. @pre begin
  void end();

  /// The one that it listens at.
  int port() const { return port_; }

  /// Lets only one server have its port, where httplib's own way shares it: for set_socket_options.
  static void keep_port(int socket);

 private:
  int port_ = 0;
  std::atomic<bool> ended_{false};
  std::thread listener_;
};

}  // namespace touchstone::apps
