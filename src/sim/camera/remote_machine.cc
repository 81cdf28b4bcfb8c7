#include <fmt/format.h>

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "base/check.h"
#include "sim/camera/machine_link.h"
#include "sim/camera/unix_socket.h"

namespace trammel::sim {
namespace {

constexpr double kPatienceS = 10;                 // a large bed on a busy host takes seconds
constexpr std::size_t kLongestSmallAnswer = 256;  // bytes; of everything but a bed

class Remote final : public RemoteMachine {
 public:
  Remote(std::string path, UnixSocket socket)
      : path_(std::move(path)), socket_(std::move(socket)), bed_(std::make_shared<const Bed>()) {}

  Result<void> Greet() {
    const std::lock_guard lock(mutex_);
    const auto world = Ask(WorldQuestion{}, kLongestSmallAnswer, DecodeWorld);
    if (!world) return tl::unexpected(*failure_);
    world_ = *world;
    return {};
  }

  MachineView At(double monotonic_s) const override {
    const std::lock_guard lock(mutex_);
    if (const auto view = Ask(ViewQuestion{monotonic_s}, kLongestSmallAnswer, DecodeView)) {
      view_ = *view;
    }
    return view_;
  }

  std::shared_ptr<const Bed> bed(double monotonic_s) const override {
    const std::lock_guard lock(mutex_);
    const auto answer = Ask(BedQuestion{monotonic_s, bed_version_}, kLongestAnswer, DecodeBed);
    if (!answer) return bed_;
    if (answer->bed != nullptr) {
      bed_ = answer->bed;
      bed_version_ = answer->version;
    } else if (answer->version != bed_version_) {
      End(fmt::format("it sent no bed {}", answer->version));
    }
    return bed_;
  }

  const MachineWorld& world() const override { return world_; }

  Result<void> Announce(int camera_port) override {
    TRAMMEL_CHECK(camera_port >= 1 && camera_port <= 65535, "camera_port = {}", camera_port);
    const std::lock_guard lock(mutex_);
    const CameraNotice notice{static_cast<std::uint16_t>(camera_port)};
    const auto taken = Ask(notice, 0, [](std::string_view) -> Result<bool> { return true; });
    if (!taken) return tl::unexpected(*failure_);
    return {};
  }

  Result<void> Check() const override {
    // Whoever holds it waits for an answer, and will notice.
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock) return {};
    if (!failure_ && socket_.ended()) End("the other side has closed the connection");
    if (failure_) return tl::unexpected(*failure_);
    return {};
  }

 private:
  // One round trip. Nothing where the link fails now or did before.
  template <class Decoder>
  auto Ask(const Question& question, std::size_t longest, Decoder decode) const
      -> std::optional<typename decltype(decode(std::string_view()))::value_type> {
    if (failure_) return std::nullopt;
    Result<void> sent = socket_.Send(Encode(question), kPatienceS);
    Result<std::string> bytes = sent ? socket_.Receive(longest, kPatienceS)
                                     : Result<std::string>(tl::unexpected(sent.error()));
    if (!bytes) {
      End(bytes.error().message);
      return std::nullopt;
    }
    auto answer = decode(*bytes);
    if (!answer) {
      End("it sent " + answer.error().message);
      return std::nullopt;
    }
    return std::move(*answer);
  }

  void End(const std::string& why) const {
    failure_ = Error{ErrorKind::kMachine,
                     fmt::format("lost the virtual printer behind the machine socket {}: {}; is "
                                 "\"trammel-sim printer --machine-socket\" still running?",
                                 path_, why)};
  }

  std::string path_;
  UnixSocket socket_;
  MachineWorld world_;
  mutable std::mutex mutex_;
  mutable MachineView view_;
  mutable std::shared_ptr<const Bed> bed_;
  mutable std::uint64_t bed_version_ = 0;
  mutable std::optional<Error> failure_;
};

}  // namespace

Result<std::shared_ptr<RemoteMachine>> RemoteMachine::Connect(const std::filesystem::path& path) {
  Result<UnixSocket> socket = UnixSocket::Connect(path);
  if (!socket) {
    return Fail(fmt::format("cannot reach a virtual printer at the machine socket {}: {}; start "
                            "\"trammel-sim printer --machine-socket {}\" first",
                            path.string(), socket.error().message, path.string()),
                socket.error().kind);
  }
  auto remote = std::make_shared<Remote>(path.string(), std::move(*socket));
  TRY(remote->Greet());
  return remote;
}

}  // namespace trammel::sim
