#include "apps/event_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <list>
#include <string_view>
#include <thread>
#include <utility>

#include "core/error.h"
#include "datasets/sets/run_identity.h"
#include "sensors/events/event_file_evt3.h"

namespace touchstone::apps {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kSlice_ms = 5;      // how long events are gathered
constexpr int kMostClients = 64;  // at once
constexpr int kWaiting = 16;      // connections that may wait to be taken

/// A file descriptor that is closed at its end.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

int listen_at(const std::string& address, int port) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(static_cast<std::uint16_t>(port));
  const std::string numbers = address == "localhost" ? "127.0.0.1" : address;
  if (inet_pton(AF_INET, numbers.c_str(), &at.sin_addr) != 1) {
    fail("--address {}: must be four numbers, as 127.0.0.1", address);
  }
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int yes = 1;
  if (fd >= 0) ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (fd < 0 || ::bind(fd, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0 || ::listen(fd, kWaiting) != 0) {
    const std::string why = std::strerror(errno);
    if (fd >= 0) ::close(fd);
    fail("can't listen for events at {}:{}: {}; another --events-port may be free, 0 takes any", address, port, why);
  }
  return fd;
}

int port_of(int fd) {
  sockaddr_in at{};
  socklen_t size = sizeof at;
  TS_ASSERT(::getsockname(fd, reinterpret_cast<sockaddr*>(&at), &size) == 0);
  return ntohs(at.sin_port);
}

/// Where a client is in the loop's endless time.
struct Place {
  std::int64_t round = 0;
  std::size_t next = 0;
};

Place place_after(const EventLoop& loop, std::int64_t t_us) {
  Place place;
  place.round = t_us / loop.period_us;
  const std::int64_t within = t_us % loop.period_us;
  const auto at = std::upper_bound(loop.events.begin(), loop.events.end(), within,
                                   [](std::int64_t t, const Event& event) { return t < event.t_us; });
  place.next = static_cast<std::size_t>(at - loop.events.begin());
  return place;
}

}  // namespace

struct EventServer::Parts {
  struct Client {
    explicit Client(int fd) : socket(fd) {}
    Descriptor socket;
    std::thread thread;
    std::atomic<bool> ended{false};
  };

  Parts(EventLoop of, const std::string& address, int port)
      : loop(std::move(of)), start(Clock::now()), listening(listen_at(address, port)) {
    // What EVT 3.0 can't hold is refused here and not to a client.
    sensors::Evt3Encoder("--events", loop.size, datasets::program_name(), [](std::string_view) {});
    acceptor = std::thread([this] { accept_clients(); });
  }

  ~Parts() {
    stopping = true;
    acceptor.join();
    for (Client& client : clients) ::shutdown(client.socket.get(), SHUT_RDWR);
    for (Client& client : clients) client.thread.join();
  }

  std::int64_t now_us() const {
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    return static_cast<std::int64_t>(1e6 * loop.speed * seconds);
  }

  void accept_clients() {
    constexpr int kPoll_ms = 50;
    while (!stopping) {
      pollfd ready{listening.get(), POLLIN, 0};
      const int events = ::poll(&ready, 1, kPoll_ms);
      clients.remove_if([](Client& client) {
        if (!client.ended) return false;
        client.thread.join();
        return true;
      });
      if (events <= 0) continue;
      const int fd = ::accept4(listening.get(), nullptr, nullptr, SOCK_CLOEXEC);
      if (fd < 0) continue;
      if (clients.size() >= kMostClients) {
        ::close(fd);
        continue;
      }
      Client& client = clients.emplace_back(fd);
      client.thread = std::thread([this, &client] {
        serve(client.socket.get());
        ::shutdown(client.socket.get(), SHUT_RDWR);
        client.ended = true;
      });
    }
  }

  /// Sends until the client goes away or all is stopped.
  void serve(int socket) const {
    bool open = true;
    const auto send_all = [&](std::string_view bytes) {
      while (open && !bytes.empty()) {
        const ssize_t sent = ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR) continue;
        if (sent <= 0) {
          open = false;
        } else {
          bytes.remove_prefix(static_cast<std::size_t>(sent));
        }
      }
    };
    sensors::Evt3Encoder encoder("a client", loop.size, datasets::program_name(), send_all);
    std::int64_t sent_until = now_us();
    Place place = place_after(loop, sent_until);
    encoder.start(sent_until);
    std::vector<Event> slice;
    while (open && !stopping) {
      const std::int64_t now = now_us();
      slice.clear();
      for (;;) {
        const std::int64_t base = place.round * loop.period_us;
        for (; place.next < loop.events.size() && base + loop.events[place.next].t_us <= now; ++place.next) {
          slice.push_back(loop.events[place.next]);
          slice.back().t_us += base;
        }
        if (place.next < loop.events.size() || base + loop.period_us > now) break;
        place = {place.round + 1, 0};
      }
      encoder.append(slice);
      encoder.pass_time(now);
      encoder.flush();
      std::this_thread::sleep_for(std::chrono::milliseconds(kSlice_ms));  // who has gone is noticed by the next send
    }
  }

  EventLoop loop;
  Clock::time_point start;
  Descriptor listening;
  std::atomic<bool> stopping{false};
  std::list<Client> clients;  // touched by the acceptor alone while it runs
  std::thread acceptor;
};

EventServer::EventServer(EventLoop loop, const std::string& address, int port) {
  TS_ASSERT(loop.period_us > 0 && loop.speed > 0.0);
  parts_ = std::make_unique<Parts>(std::move(loop), address, port);
}
EventServer::~EventServer() = default;

int EventServer::port() const {
  return port_of(parts_->listening.get());
}

}  // namespace touchstone::apps
