#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "base/text.h"
#include "machine/camera/camera.h"
#include "machine/camera/camera_sources.h"
#include "machine/net/file_bytes.h"
#include "machine/net/host_clock.h"

namespace trammel::machine {
namespace {

namespace fs = std::filesystem;

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

/// Removes the digits at the front of the text and returns them without leading zeros.
std::string_view TakeNumber(std::string_view& text) {
  std::size_t end = 0;
  while (end < text.size() && IsDigit(text[end])) ++end;
  std::string_view digits = text.substr(0, end);
  text.remove_prefix(end);
  digits.remove_prefix(std::min(digits.find_first_not_of('0'), digits.size()));
  return digits;
}

bool Before(const std::string& a, const std::string& b) {
  std::string_view left = a;
  std::string_view right = b;
  while (!left.empty() && !right.empty()) {
    if (IsDigit(left.front()) && IsDigit(right.front())) {
      const std::string_view x = TakeNumber(left);
      const std::string_view y = TakeNumber(right);
      if (x.size() != y.size()) return x.size() < y.size();
      if (x != y) return x < y;
    } else {
      if (left.front() != right.front()) return left.front() < right.front();
      left.remove_prefix(1);
      right.remove_prefix(1);
    }
  }
  return left.size() != right.size() ? left.size() < right.size() : a < b;
}

bool IsPicture(const fs::path& path) {
  const std::string extension = LowerCase(path.extension().string());
  return extension == ".jpg" || extension == ".jpeg" || extension == ".png";
}

class ImageFolder final : public FrameSource {
 public:
  ImageFolder(fs::path folder, std::vector<std::string> names, std::size_t max_bytes)
      : folder_(std::move(folder)), names_(std::move(names)), max_bytes_(max_bytes) {}

  Result<std::optional<CapturedFrame>> Next(double, std::stop_token stop) override {
    if (stop.stop_requested()) return Fail("stopped", ErrorKind::kInterrupted);
    if (next_ == names_.size()) return std::nullopt;
    const fs::path path = folder_ / names_[next_];
    CapturedFrame frame;
    frame.sequence = next_++;
    auto bytes = ReadFileBytes(path, static_cast<std::int64_t>(max_bytes_));
    if (!bytes) {
      return Fail(fmt::format("picture '{}': {}", path.string(), bytes.error().message),
                  ErrorKind::kMeasurement);
    }
    frame.image = std::move(*bytes);
    frame.arrival_s = HostNow();
    checker_.Check(frame);
    return frame;
  }
  [[nodiscard]] std::string Describe() const override {
    return fmt::format("folder {} with {} pictures, without capture times", folder_.string(),
                       names_.size());
  }
  [[nodiscard]] bool live() const override { return false; }

 private:
  fs::path folder_;
  std::vector<std::string> names_;
  std::size_t max_bytes_;
  std::size_t next_ = 0;
  FrameChecker checker_;
};

}  // namespace

Result<std::unique_ptr<FrameSource>> OpenImageFolder(const fs::path& folder,
                                                     const CameraOptions& options) {
  constexpr std::size_t kMaxFiles = 100'000;
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    std::error_code ignored;
    if (IsPicture(at->path()) && at->is_regular_file(ignored)) {
      names.push_back(at->path().filename().string());
    }
    if (names.size() > kMaxFiles) {
      return Fail(fmt::format("folder '{}': more than {} pictures", folder.string(), kMaxFiles),
                  ErrorKind::kMeasurement);
    }
  }
  if (error) {
    return Fail(fmt::format("folder '{}': cannot be read ({})", folder.string(), error.message()),
                ErrorKind::kMeasurement);
  }
  if (names.empty()) {
    return Fail(fmt::format("folder '{}': holds no .jpg, .jpeg or .png file", folder.string()),
                ErrorKind::kMeasurement);
  }
  std::sort(names.begin(), names.end(), Before);
  return std::make_unique<ImageFolder>(folder, std::move(names), options.max_frame_bytes);
}

}  // namespace trammel::machine
