#include "machine/scanner/sane_scan.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <csignal>
#include <cstring>

#include "machine/scanner/sane_device.h"

namespace trammel::machine {
namespace {

// What a signal's handler can reach; in the driver's process only.
std::atomic<SANE_Handle> g_scanning = nullptr;
static_assert(std::atomic<SANE_Handle>::is_always_lock_free);

// SANE allows sane_cancel() here, but not every driver returns from it.
void CancelScan(int) {
  constexpr unsigned kPatience_s = 30;
  alarm(kPatience_s);
  SANE_Handle handle = g_scanning.load();
  if (handle == nullptr) _exit(1);
  sane_cancel(handle);
}

// While it lives, SIGTERM cancels the scan rather than the process.
class Cancellable {
 public:
  explicit Cancellable(const SaneDevice& device) {
    g_scanning = device.handle();
    std::signal(SIGTERM, CancelScan);
  }
  ~Cancellable() { g_scanning = nullptr; }
  Cancellable(const Cancellable&) = delete;
  Cancellable& operator=(const Cancellable&) = delete;
};

bool Send(const ChildSender& sender, ScannerMessage kind, std::string_view text = {}) {
  return sender.Send(static_cast<std::uint32_t>(kind), text);
}

template <class T>
bool SendValue(const ChildSender& sender, ScannerMessage kind, const T& value) {
  std::array<char, sizeof(T)> bytes{};
  std::memcpy(bytes.data(), &value, sizeof(T));
  return Send(sender, kind, {bytes.data(), bytes.size()});
}

void SendError(const ChildSender& sender, const Error& error) {
  Send(sender, ScannerMessage::kError, static_cast<char>(error.kind) + error.message);
}

std::string Lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

Result<std::string> ChooseDevice(const std::string& wanted) {
  if (!wanted.empty()) return wanted;
  const auto devices = SaneDevices();
  if (!devices) return tl::unexpected(devices.error());
  if (devices->size() == 1) return devices->front()->name;
  if (devices->empty()) {
    return Fail(
        "no scanner was found: switch it on, look at cable or network, and whether "
        "scanimage -L finds it",
        ErrorKind::kMachine);
  }
  std::string names;
  for (const SANE_Device* device : *devices) names += fmt::format("\n  {}", device->name);
  return Fail(fmt::format("there are several scanners; name one of them with --device:{}", names));
}

// The scanner's own word for grey or colour.
Result<void> SetMode(const SaneDevice& device, bool color) {
  const auto option = device.Find("mode");
  if (!option) return {};
  const std::vector<std::string> choices = SaneDevice::Choices(*option);
  for (const std::string& choice : choices) {
    const std::string name = Lower(choice);
    const bool is_color = name.find("color") != std::string::npos;
    const bool is_grey =
        name.find("gray") != std::string::npos || name.find("grey") != std::string::npos;
    if (color ? is_color : is_grey && !is_color) return device.SetText(*option, choice);
  }
  return choices.empty() ? Result<void>{}
                         : Fail(fmt::format("the scanner has no {} mode; leave --color {}",
                                            color ? "colour" : "grey", color ? "away" : "on"));
}

Result<double> SetResolution(const SaneDevice& device, double dpi) {
  const auto option = device.Find("resolution");
  if (!option) {
    return Fail("the scanner does not let its resolution be chosen", ErrorKind::kMachine);
  }
  auto taken = device.SetNumber(*option, dpi);
  if (!taken) return taken;
  if (const auto other = device.Find("y-resolution")) {
    if (auto set = device.SetNumber(*other, dpi); !set) return set;
  }
  return taken;
}

Result<void> SetArea(const SaneDevice& device, const std::optional<ScanArea>& area) {
  struct Corner {
    const char* name;
    double value;
    bool far;  // all of the glass: as far as it goes
  };
  const ScanArea a = area.value_or(ScanArea{});
  const std::array<Corner, 4> corners = {{{"tl-x", a.x_mm, false},
                                          {"tl-y", a.y_mm, false},
                                          {"br-x", a.x_mm + a.width_mm, true},
                                          {"br-y", a.y_mm + a.height_mm, true}}};
  for (const Corner& corner : corners) {
    const auto option = device.Find(corner.name);
    if (!option) continue;
    const std::optional<double> largest = SaneDevice::Largest(*option);
    if (!area && !largest) continue;
    if (area && option->descriptor->unit != SANE_UNIT_MM) {
      return Fail("the scanner does not count in mm: leave the area away");
    }
    const double value = !area ? (corner.far ? *largest : 0) : corner.value;
    if (auto set = device.SetNumber(*option, value); !set) return tl::unexpected(set.error());
  }
  return {};
}

// @returns the resolution that the scanner took.
Result<double> SetUp(const SaneDevice& device, const ScanRequest& request) {
  if (const auto source = device.Find("source")) {
    const std::vector<std::string> choices = SaneDevice::Choices(*source);
    if (std::find(choices.begin(), choices.end(), "Flatbed") != choices.end()) {
      if (auto set = device.SetText(*source, "Flatbed"); !set) return tl::unexpected(set.error());
    }
  }
  if (auto set = SetMode(device, request.color); !set) return tl::unexpected(set.error());
  if (const auto depth = device.Find("depth")) {
    constexpr double kBits = 8;
    if (auto set = device.SetNumber(*depth, kBits); !set) return set;
  }
  const auto dpi = SetResolution(device, request.dpi);
  if (!dpi) return dpi;
  if (auto set = SetArea(device, request.area); !set) return tl::unexpected(set.error());
  for (const auto& [name, value] : request.options) {
    const auto option = device.Find(name);
    if (!option) return Fail(fmt::format("the scanner has no option '{}' to set", name));
    if (auto set = device.SetFromText(*option, value); !set) return tl::unexpected(set.error());
  }
  return dpi;
}

FrameHead HeadOf(const SANE_Parameters& p) {
  FrameHead head;
  using Colors = FrameHead::Colors;
  switch (p.format) {
    case SANE_FRAME_RGB:
      head.colors = Colors::kRgb;
      break;
    case SANE_FRAME_RED:
      head.colors = Colors::kRed;
      break;
    case SANE_FRAME_GREEN:
      head.colors = Colors::kGreen;
      break;
    case SANE_FRAME_BLUE:
      head.colors = Colors::kBlue;
      break;
    default:
      head.colors = Colors::kGrey;
  }
  head.width_px = p.pixels_per_line;
  head.lines = p.lines;
  head.bytes_per_line = p.bytes_per_line;
  head.bits = p.depth;
  head.last = p.last_frame == SANE_TRUE ? 1 : 0;
  return head;
}

// @returns whether another one follows and is wanted.
Result<bool> SendFrame(const SaneDevice& device, const ChildSender& sender) {
  if (const SANE_Status status = sane_start(device.handle()); status != SANE_STATUS_GOOD) {
    return tl::unexpected(SaneError("starting to scan", status));
  }
  SANE_Parameters parameters{};
  if (const SANE_Status status = sane_get_parameters(device.handle(), &parameters);
      status != SANE_STATUS_GOOD) {
    return tl::unexpected(SaneError("asking what the scanner sends", status));
  }
  bool heard = SendValue(sender, ScannerMessage::kFrame, HeadOf(parameters));
  std::vector<std::uint8_t> piece(std::size_t{1} << 18U);
  while (heard) {
    SANE_Int count = 0;
    const SANE_Status status =
        sane_read(device.handle(), piece.data(), static_cast<SANE_Int>(piece.size()), &count);
    if (status == SANE_STATUS_EOF) {
      return Send(sender, ScannerMessage::kFrameEnd) && parameters.last_frame == SANE_FALSE;
    }
    if (status != SANE_STATUS_GOOD) return tl::unexpected(SaneError("scanning", status));
    heard = sender.Send(static_cast<std::uint32_t>(ScannerMessage::kSamples),
                        std::span(piece).first(static_cast<std::size_t>(std::max(count, 0))));
  }
  return false;
}

// All that is to be told before the device is closed.
Result<double> SendPage(const SaneDevice& device, const ScanRequest& request,
                        const ChildSender& sender) {
  const auto dpi = SetUp(device, request);
  if (!dpi) return dpi;
  constexpr int kMostFrames = 3;  // one of each colour
  for (int i = 0; i < kMostFrames; ++i) {
    const auto more = SendFrame(device, sender);
    if (!more) return tl::unexpected(more.error());
    if (!*more) break;
  }
  return dpi;
}

}  // namespace

void ListInChild(const ChildSender& sender) {
  if (auto started = StartSane(); !started) return SendError(sender, started.error());
  const auto devices = SaneDevices();
  if (!devices) return SendError(sender, devices.error());
  for (const SANE_Device* device : *devices) {
    std::string text;
    for (const char* part : {device->name, device->vendor, device->model, device->type}) {
      text += part == nullptr ? "" : part;
      text += '\0';
    }
    Send(sender, ScannerMessage::kScanner, text);
  }
  SendValue(sender, ScannerMessage::kDone, 0.0);
}

void ScanInChild(const ScanRequest& request, const ChildSender& sender) {
  if (auto started = StartSane(); !started) return SendError(sender, started.error());
  const auto name = ChooseDevice(request.device);
  if (!name) return SendError(sender, name.error());
  Send(sender, ScannerMessage::kChosen, *name);
  const auto device = SaneDevice::Open(*name);
  if (!device) return SendError(sender, device.error());
  const Cancellable cancellable(*device);
  const auto dpi = SendPage(*device, request, sender);
  if (!dpi) return SendError(sender, dpi.error());
  SendValue(sender, ScannerMessage::kDone, *dpi);
}

}  // namespace trammel::machine
