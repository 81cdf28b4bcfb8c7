#include "machine/cad/step_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "files/whole_file.h"
#include "machine/cad/step_module.h"
#include "machine/net/child_process.h"

namespace trammel::machine {
namespace {

constexpr double kBytesPerMb = 1e6;

/// Memory limit of Open CASCADE for a file. A plate with 800 bores, of 3 MB, took 0.3 GB.
std::uint64_t MostBytes(std::size_t file_bytes) {
  return (std::uint64_t{1} << 30U) + 25 * std::uint64_t{file_bytes};
}

/// Builds the solid from the child's messages, which are checked against limits.
class Taken {
 public:
  // False if the message is invalid.
  bool Take(const ChildMessage& message) {
    const std::string text(message.bytes.begin(), message.bytes.end());
    constexpr std::size_t kMaxNotices = 100;
    switch (message.kind) {
      case kStepHead:
        return TakeHead(message);
      case kStepUnit:
        solid_.unit = text;
        return true;
      case kStepNotice:
        solid_.notices.push_back(text);
        return solid_.notices.size() <= kMaxNotices;
      case kStepVertices:
        return Append(message, solid_.vertices_mm, head_.vertices);
      case kStepTriangles:
        return Append(message, solid_.triangles, head_.triangles);
      case kStepLifts:
        return Append(message, solid_.lifts, head_.triangles);
      default:
        return false;
    }
  }

  [[nodiscard]] bool IsWhole() const {
    if (solid_.unit.empty() || solid_.vertices_mm.size() != head_.vertices ||
        solid_.triangles.size() != head_.triangles || solid_.lifts.size() != head_.triangles) {
      return false;
    }
    for (const auto& triangle : solid_.triangles) {
      for (const std::uint32_t vertex : triangle) {
        if (vertex >= solid_.vertices_mm.size()) return false;
      }
    }
    for (const StepLift& lift : solid_.lifts) {
      for (const float mm : lift.middle_mm) {
        if (!std::isfinite(mm)) return false;
      }
      if (!std::isfinite(lift.left_mm)) return false;
    }
    return true;
  }
  [[nodiscard]] StepSolid Take() { return std::move(solid_); }

 private:
  bool TakeHead(const ChildMessage& message) {
    constexpr std::uint64_t kMax = 20'000'000;
    if (message.bytes.size() != sizeof head_ || head_.triangles != 0) return false;
    std::memcpy(&head_, message.bytes.data(), sizeof head_);
    solid_.faces = head_.faces;
    solid_.chord_error_mm = head_.chord_error_mm;
    return head_.vertices <= kMax && head_.triangles <= kMax;
  }

  template <class T>
  static bool Append(const ChildMessage& message, std::vector<T>& to, std::uint64_t most) {
    const std::size_t count = message.bytes.size() / sizeof(T);
    if (count * sizeof(T) != message.bytes.size() || count > most - to.size()) return false;
    const std::size_t before = to.size();
    to.resize(before + count);
    std::memcpy(static_cast<void*>(to.data() + before), message.bytes.data(), message.bytes.size());
    return true;
  }

  StepHead head_;
  StepSolid solid_;
};

Result<StepSolid> TakeSolid(ChildProcess& child, std::uint64_t max_bytes, int max_s) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point end = Clock::now() + std::chrono::seconds(max_s);
  const auto left_s = [&] {
    return std::max(0.0, std::chrono::duration<double>(end - Clock::now()).count());
  };
  Taken taken;
  ChildMessage message;
  Received heard = Received::kSilence;
  while ((heard = child.Receive(message, left_s(), {})) == Received::kMessage) {
    if (message.kind == kStepFault) {
      return Fail(std::string(message.bytes.begin(), message.bytes.end()));
    }
    if (message.kind == kStepEnds) {
      if (!taken.IsWhole()) break;
      return taken.Take();
    }
    if (!taken.Take(message)) break;
  }
  if (heard == Received::kSilence) {
    return Fail(
        fmt::format("Open CASCADE has not read it within {} s: export the part alone and "
                    "simplified, or an STL; or run it again on a computer that is less "
                    "busy",
                    max_s));
  }
  return Fail(fmt::format(
      "Open CASCADE ended without a word over it ({}): it is damaged, or takes more than {} s or "
      "{} MB; export it anew as AP214, or an STL",
      child.End(), max_s, max_bytes >> 20U));
}

/// Merges DATA sections into one without a name, as in edition 1 of ISO 10303-21: Open CASCADE 7.6
/// rejects others as damaged. Offsets and lines are preserved.
std::string AsEdition1(std::string text) {
  const auto blank = [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) text[i] = text[i] == '\n' ? '\n' : ' ';
  };
  constexpr auto kNone = std::string::npos;
  std::size_t begin = kNone;  // start of a statement
  std::size_t section_end = kNone;
  bool data = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\'') {
      i = text.find('\'', i + 1);
    } else if (text.compare(i, 2, "/*") == 0) {
      i = text.find("*/", i + 2);
    } else if (text[i] == ';') {
      const std::string_view statement(&text[std::min(begin, i)], i - std::min(begin, i));
      if (statement.starts_with("DATA") &&
          (statement.size() == 4 || std::isalnum(static_cast<unsigned char>(statement[4])) == 0)) {
        if (data && section_end != kNone) {
          blank(section_end, i + 1);
        } else {
          blank(begin + 4, i + 1);
          text[begin + 4] = ';';
        }
        data = true;
      }
      section_end = statement.starts_with("ENDSEC") ? begin : kNone;
      begin = kNone;
    } else if (begin == kNone && std::isspace(static_cast<unsigned char>(text[i])) == 0) {
      begin = i;
    }
    if (i == kNone) break;
  }
  return text;
}

Result<StepSolid> Read(std::string text, const StepReadOptions& options) {
  constexpr double kPatience_s = 1;
  if (text.starts_with("PK") || text.starts_with("\x1f\x8b")) {
    return Fail("it is packed; unpack it first");
  }
  if (!LooksLikeStep(text)) {
    return Fail("it is no STEP file: it does not begin with \"ISO-10303-21;\"");
  }
  constexpr std::string_view kEnd = "END-ISO-10303-21;";
  if (text.find(kEnd) == std::string_view::npos) {
    return Fail(
        fmt::format("it ends without \"{}\": it is cut short; export or copy it anew", kEnd));
  }
  const auto module = FindStepModule();
  if (!module) {
    return Fail(fmt::format("{}; or export an STL", module.error().message));
  }
  text = AsEdition1(std::move(text));
  const std::uint64_t max_bytes = MostBytes(text.size());
  auto child = TRY(ChildProcess::Start(
      [&](const ChildSender& sender) {
        LimitThisProcess(max_bytes, options.max_s);
        const auto sent = (*module)->send_solid(text, options, sender);
        sender.Send(sent ? kStepEnds : kStepFault,
                    sent ? std::string_view() : sent.error().message);
      },
      kPatience_s));
  return TakeSolid(child, max_bytes, options.max_s);
}

}  // namespace

bool LooksLikeStep(std::string_view start) {
  constexpr std::size_t kLooked = 4096;
  return !start.starts_with("solid") &&
         start.substr(0, kLooked).find("ISO-10303-21;") != std::string_view::npos;
}

Result<StepSolid> ReadStepFile(const std::filesystem::path& path, const StepReadOptions& options) {
  std::error_code unknown;
  const std::uintmax_t size = std::filesystem::file_size(path, unknown);
  if (!unknown && size > kMaxStepBytes) {
    return Fail(fmt::format(
        "{}: {:.0f} MB; {:.0f} MB are read at most: export the part alone, "
        "without what it is assembled with, or an STL",
        path.string(), static_cast<double>(size) / kBytesPerMb, kMaxStepBytes / kBytesPerMb));
  }
  auto text = TRY(files::ReadNamedFile(path, kMaxStepBytes));
  auto solid = Read(std::move(text), options);
  if (!solid) {
    return tl::unexpected(
        Error{solid.error().kind, fmt::format("{}: {}", path.string(), solid.error().message)});
  }
  return solid;
}

}  // namespace trammel::machine
