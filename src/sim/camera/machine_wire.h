// What goes over a machine's socket: records of fixed form in the byte order of this machine, which
// both ends run on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <variant>

#include "base/result.h"
#include "sim/camera/machine_view.h"
#include "sim/print/conditions.h"

namespace trammel::sim {

/// What a camera has to know of the world beside the machine's state.
struct MachineWorld {
  std::uint64_t seed = 0;
  Condition condition;
  double speed = 1;  ///< machine seconds per second of the host, 0.1 … 1000
};

constexpr std::size_t kLongestQuestion = 64;       // bytes
constexpr std::size_t kLongestAnswer = 256 << 20;  // 100 m of line have 2 million samples: 80 MB

struct WorldQuestion {};
struct ViewQuestion {
  double monotonic_s = 0;
};
struct BedQuestion {
  double monotonic_s = 0;
  std::uint64_t known_version = 0;  ///< 0: none
};
/// Says where the camera serves its frames: http://127.0.0.1:PORT. The answer is empty.
struct CameraNotice {
  std::uint16_t port = 0;  ///< not 0
};
using Question = std::variant<WorldQuestion, ViewQuestion, BedQuestion, CameraNotice>;

struct BedAnswer {
  std::uint64_t version = 0;       ///< counted from 1
  std::shared_ptr<const Bed> bed;  ///< null where the version is the known one
};

[[nodiscard]] std::string Encode(const Question& question);
[[nodiscard]] std::string Encode(const MachineWorld& world);
[[nodiscard]] std::string Encode(const MachineView& view);
[[nodiscard]] std::string Encode(const BedAnswer& answer);

// Errors (kMachine): of another form or length, or numbers that no machine has: what comes out is
// finite, places within ±10 m, sizes within 0 … 10 m, conditions among those that exist.
[[nodiscard]] Result<Question> DecodeQuestion(std::string_view bytes);
[[nodiscard]] Result<MachineWorld> DecodeWorld(std::string_view bytes);
[[nodiscard]] Result<MachineView> DecodeView(std::string_view bytes);
[[nodiscard]] Result<BedAnswer> DecodeBed(std::string_view bytes);

}  // namespace trammel::sim
