#include "sim/camera/machine_link.h"

#include <fmt/format.h>

#include <atomic>
#include <cstdint>
#include <limits>
#include <list>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <variant>

#include "base/bug_note.h"
#include "base/thread_priority.h"
#include "sim/camera/camera_http.h"
#include "sim/camera/unix_socket.h"

namespace trammel::sim {
namespace {

constexpr std::size_t kMostClients = 8;
constexpr double kPatienceS = 30;        // with a client that takes no answer
constexpr double kLongestAgoS = 60;      // that a client may ask for
constexpr double kFurthestAheadS = 0.1;  // the end of an exposure; what was seen has happened

class Serving final : public MachineLink {
 public:
  Serving(std::filesystem::path path, UnixSocket listener,
          std::shared_ptr<const MachineSource> machine, const MachineWorld& world)
      : path_(std::move(path)),
        listener_(std::move(listener)),
        machine_(std::move(machine)),
        world_(world),
        thread_([this] { (void)NoteBug([this] { Listen(); }); }) {}
  ~Serving() override {
    listener_.Shutdown();
    thread_.join();
    for (const Client& client : clients_) client.socket.Shutdown();
    clients_.clear();
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }

  int camera_port() const override { return camera_port_; }

 private:
  struct Client {
    explicit Client(UnixSocket accepted) : socket(std::move(accepted)) {}
    UnixSocket socket;
    std::atomic<bool> done = false;
    std::jthread thread;  // last: joined before the socket goes
  };

  void Listen() {
    while (Result<UnixSocket> accepted = listener_.Accept()) {
      clients_.remove_if([](const Client& client) { return client.done.load(); });
      if (clients_.size() >= kMostClients) continue;
      Client& client = clients_.emplace_back(std::move(*accepted));
      client.thread = std::jthread([this, &client] {
        (void)NoteBug([&] {
          RaiseThisThread(ThreadUrgency::kWorking);
          while (AnswerNext(client.socket)) {
          }
        });
        client.socket.Shutdown();
        client.done = true;
      });
    }
  }

  bool AnswerNext(const UnixSocket& socket) {
    constexpr double kForever = std::numeric_limits<double>::infinity();
    const Result<std::string> bytes = socket.Receive(kLongestQuestion, kForever);
    if (!bytes) return false;
    const Result<Question> question = DecodeQuestion(*bytes);
    if (!question) return false;
    const std::optional<std::string> answer =
        std::visit([this](const auto& asked) { return Answer(asked); }, *question);
    return answer && answer->size() <= kLongestAnswer && socket.Send(*answer, kPatienceS);
  }

  static bool IsNow(double monotonic_s) {
    const double ahead_s = monotonic_s - MonotonicNow();
    return ahead_s >= -kLongestAgoS && ahead_s <= kFurthestAheadS;
  }

  std::optional<std::string> Answer(const WorldQuestion&) const { return Encode(world_); }
  std::optional<std::string> Answer(const ViewQuestion& asked) const {
    if (!IsNow(asked.monotonic_s)) return std::nullopt;
    return Encode(machine_->At(asked.monotonic_s));
  }
  std::optional<std::string> Answer(const BedQuestion& asked) {
    if (!IsNow(asked.monotonic_s)) return std::nullopt;
    BedAnswer answer;
    {
      const std::lock_guard lock(bed_mutex_);
      std::shared_ptr<const Bed> bed = machine_->bed(asked.monotonic_s);
      if (bed != bed_) {
        bed_ = std::move(bed);
        ++bed_version_;
      }
      answer = {bed_version_, bed_version_ == asked.known_version ? nullptr : bed_};
    }
    return Encode(answer);
  }
  std::optional<std::string> Answer(const CameraNotice& notice) {
    camera_port_ = notice.port;
    return std::string();
  }

  std::filesystem::path path_;
  UnixSocket listener_;
  std::shared_ptr<const MachineSource> machine_;
  MachineWorld world_;
  std::atomic<int> camera_port_ = 0;
  std::mutex bed_mutex_;
  std::shared_ptr<const Bed> bed_;
  std::uint64_t bed_version_ = 0;
  std::list<Client> clients_;  // of the listening thread; without it, of the destructor
  std::thread thread_;         // last: it uses all of the above
};

}  // namespace

Result<std::unique_ptr<MachineLink>> MachineLink::Serve(
    const std::filesystem::path& path, std::shared_ptr<const MachineSource> machine,
    const MachineWorld& world) {
  Result<UnixSocket> listener = UnixSocket::Listen(path);
  if (!listener) {
    return Fail(fmt::format("cannot serve the machine on the Unix socket {}: {}; remove it, or "
                            "choose another path",
                            path.string(), listener.error().message),
                listener.error().kind);
  }
  return std::make_unique<Serving>(path, std::move(*listener), std::move(machine), world);
}

}  // namespace trammel::sim
