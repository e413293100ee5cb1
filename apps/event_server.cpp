#include "apps/event_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <spdlog/spdlog.h>
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
constexpr int kSendBuffer = 256 * 1024;
constexpr std::size_t kPiece = 1 << 16;             // events that are turned into bytes at once
constexpr auto kMostLag = std::chrono::seconds(2);  // behind which events are left out
constexpr auto kStuck = std::chrono::seconds(1);    // who takes nothing for so long makes room for who comes

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
  if (fd >= 0) {
    ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    ::setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer);  // the clients' sockets inherit it
  }
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
    std::atomic<Clock::rep> blocked_since{0};  // 0: it takes what it is sent
    std::atomic<bool> ended{false};
  };

  Parts(EventLoop of, const std::string& address, int port, double patience_s)
      : loop(std::move(of)),
        patience(std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(patience_s))),
        start(Clock::now()),
        listening(listen_at(address, port)) {
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

  std::int64_t in_events_us(Clock::duration time) const {
    return static_cast<std::int64_t>(1e6 * loop.speed * std::chrono::duration<double>(time).count());
  }
  std::int64_t now_us() const { return in_events_us(Clock::now() - start); }

  void accept_clients() {
    constexpr int kPoll_ms = 50;
    while (!stopping) {
      pollfd ready{listening.get(), POLLIN, 0};
      const int events = ::poll(&ready, 1, kPoll_ms);
      remove_ended();
      if (events <= 0) continue;
      const int fd = ::accept4(listening.get(), nullptr, nullptr, SOCK_CLOEXEC);
      if (fd < 0) continue;
      if (clients.size() >= kMostClients && !end_stuck_client()) {
        const std::string why = fmt::format("% error {} clients are served; no more are\n% end\n", kMostClients);
        if (::send(fd, why.data(), why.size(), MSG_NOSIGNAL | MSG_DONTWAIT) < 0) {
          // Who has gone needs no answer; the buffer of one that stays holds it.
        }
        ::close(fd);
        continue;
      }
      Client& client = clients.emplace_back(fd);
      client.thread = std::thread([this, &client] {
        serve(client);
        ::shutdown(client.socket.get(), SHUT_RDWR);
        client.ended = true;
      });
    }
  }

  void remove_ended() {
    clients.remove_if([](Client& client) {
      if (!client.ended) return false;
      client.thread.join();
      return true;
    });
  }

  /// Ends who has taken nothing for longest. @returns whether there was one
  bool end_stuck_client() {
    Client* longest = nullptr;
    Clock::rep since = (Clock::now() - kStuck).time_since_epoch().count();
    for (Client& client : clients) {
      const Clock::rep blocked = client.blocked_since;
      if (blocked == 0 || blocked > since) continue;
      longest = &client;
      since = blocked;
    }
    if (longest == nullptr) return false;
    ::shutdown(longest->socket.get(), SHUT_RDWR);  // its thread's poll() returns
    longest->thread.join();
    clients.remove_if([&](const Client& client) { return &client == longest; });
    return true;
  }

  /// @returns false once the client has gone, or has taken nothing for the patience
  bool send_all(Client& client, std::string_view bytes) const {
    auto moved = Clock::now();
    while (!bytes.empty() && !stopping) {
      const ssize_t sent = ::send(client.socket.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent > 0) {
        bytes.remove_prefix(static_cast<std::size_t>(sent));
        moved = Clock::now();
        client.blocked_since = 0;
        continue;
      }
      if (sent < 0 && errno == EINTR) continue;
      if (sent == 0 || (errno != EAGAIN && errno != EWOULDBLOCK)) return false;
      client.blocked_since = moved.time_since_epoch().count();
      if (Clock::now() >= moved + patience) return false;
      // A third of the buffer has to be free before poll() says so; whoever reads slowly may not be taken for stuck.
      constexpr int kPoll_ms = 50;
      pollfd ready{client.socket.get(), POLLOUT, 0};
      ::poll(&ready, 1, kPoll_ms);
    }
    return bytes.empty();
  }

  /// Puts the next events up to `now` into `piece`, until it is full. @returns whether these are all
  bool take_events(Place& place, std::int64_t now, std::vector<Event>& piece) const {
    for (;;) {
      const std::int64_t base = place.round * loop.period_us;
      for (; place.next < loop.events.size() && base + loop.events[place.next].t_us <= now; ++place.next) {
        if (piece.size() >= kPiece) return false;
        piece.push_back(loop.events[place.next]);
        piece.back().t_us += base;
      }
      if (place.next < loop.events.size() || base + loop.period_us > now) return true;
      place = {place.round + 1, 0};
    }
  }

  /// Sends until the client goes away or all is stopped.
  void serve(Client& client) const {
    bool open = true;
    sensors::Evt3Encoder encoder("a client", loop.size, datasets::program_name(),
                                 [&](std::string_view bytes) { open = open && send_all(client, bytes); });
    std::int64_t sent_until = now_us();
    Place place = place_after(loop, sent_until);
    encoder.start(sent_until);
    std::vector<Event> piece;
    bool has_lagged = false;
    while (open && !stopping) {
      const std::int64_t now = now_us();
      if (now - sent_until > in_events_us(kMostLag)) {
        place = place_after(loop, now);
        if (!has_lagged) spdlog::warn("events: a client is {} s behind; what it missed is left out", kMostLag.count());
        has_lagged = true;
      }
      piece.clear();
      const bool all = take_events(place, now, piece);
      encoder.append(piece);
      sent_until = all ? now : piece.back().t_us;
      if (!all) continue;
      encoder.pass_time(now);
      encoder.flush();
      std::this_thread::sleep_for(std::chrono::milliseconds(kSlice_ms));  // who has gone is noticed by the next send
    }
  }

  EventLoop loop;
  Clock::duration patience;
  Clock::time_point start;
  Descriptor listening;
  std::atomic<bool> stopping{false};
  std::list<Client> clients;  // touched by the acceptor alone while it runs
  std::thread acceptor;
};

EventServer::EventServer(EventLoop loop, const std::string& address, int port, double patience_s) {
  TS_ASSERT(loop.period_us > 0 && loop.speed > 0.0 && patience_s > 0.0);
  parts_ = std::make_unique<Parts>(std::move(loop), address, port, patience_s);
}
EventServer::~EventServer() = default;

int EventServer::port() const {
  return port_of(parts_->listening.get());
}

}  // namespace touchstone::apps
