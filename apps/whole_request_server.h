#pragma once
// An HTTP server whose workers get requests only once they are there as a whole: who sends slowly, too much or nonsense
// holds no worker.

#include <httplib.h>

#include <atomic>
#include <chrono>
#include <list>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "apps/whole_request.h"

namespace touchstone::apps {

/// One thread reads from all connections that haven't sent their request yet. What it doesn't take it answers itself,
/// as {"error": "..."}: 400 no HTTP, 408 too slow, 411 a body without a length, 413 and 431 too large, 503 too many at
/// once. A connection is closed after its answer. Of a request's header lines handlers see Host, Origin, Content-Type
/// and Content-Length; `Range`, `Accept-Encoding` and the rest are left out, so that answers are whole and plain.
class WholeRequestServer : public httplib::Server {
 public:
  /// @param patience_s how long a client may take to send its request, and to take what is written to it at once
  WholeRequestServer(int workers, double patience_s);

 private:
  using Clock = std::chrono::steady_clock;

  struct Connection {
    int socket = -1;
    Clock::time_point until;
    WholeRequest request = {};
    bool answered = false;  // what still comes is thrown away until the other side has read why
  };

  class Door;

  bool process_and_close_socket(socket_t socket) override;
  void start();
  void stop_all();
  void collect();
  void take_new();
  bool read_from(Connection& connection);
  bool refuse(Connection& connection, int status, const std::string& message);
  void hand_over(int socket, std::string request);

  const int worker_count_;
  const Clock::duration patience_;
  std::optional<httplib::ThreadPool> workers_;
  std::thread collector_;
  std::atomic<bool> stopping_{false};
  std::atomic<int> waiting_{0};  // whole requests that no worker has taken yet
  int wake_ = -1;                // an eventfd
  std::mutex mutex_;
  std::vector<int> new_;               // accepted, not yet seen by the collector
  std::list<Connection> connections_;  // the collector's, oldest first
};

}  // namespace touchstone::apps
