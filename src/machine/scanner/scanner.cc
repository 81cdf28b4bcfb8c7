#include "machine/scanner/scanner.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <csignal>
#include <span>
#include <string_view>

#include "base/text.h"
#include "base/utf8.h"
#include "files/new_file.h"
#include "image/png_writer.h"
#include "machine/net/command_process.h"

namespace trammel::machine {
namespace {

constexpr std::size_t kMaxOptions = 500;  // real scanners have up to a hundred

struct Parsed {
  double value = 0;
  std::string_view rest;  // behind the number: its unit
};

std::optional<Parsed> NumberOf(std::string_view text) {
  double value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  if (read.ec != std::errc() || !std::isfinite(value)) return std::nullopt;
  const auto taken = static_cast<std::size_t>(read.ptr - text.data());
  return Parsed{value, text.substr(taken)};
}

std::string_view Before(std::string_view text, std::string_view mark) {
  return text.substr(0, text.find(mark));
}

/// Parses the values of an option: "Gray|Color", "75|150|600dpi", "0..215.9mm", "yes|no".
void TakeValues(std::string_view values, ScannerOption& option) {
  if (const std::size_t dots = values.find(".."); dots != std::string_view::npos) {
    const auto least = NumberOf(values.substr(0, dots));
    const auto most = NumberOf(values.substr(dots + 2));
    if (least && most) option.range = {least->value, most->value};
    return;
  }
  if (values.find('<') != std::string_view::npos) return;  // <int>, <string>: any
  while (!values.empty()) {
    const std::string_view choice = Before(values, "|");
    values.remove_prefix(std::min(choice.size() + 1, values.size()));
    if (!choice.empty()) option.choices.emplace_back(choice);
  }
  // The last number is followed by the unit.
  const bool numbers = std::all_of(option.choices.begin(), option.choices.end(),
                                   [](const auto& choice) { return NumberOf(choice).has_value(); });
  if (!numbers || option.choices.empty()) return;
  std::string& last = option.choices.back();
  last.resize(last.size() - NumberOf(last)->rest.size());
}

}  // namespace

bool ScannerOption::Takes(double value) const {
  if (range) return value >= range->first && value <= range->second;
  constexpr double kSame = 1e-3;
  return choices.empty() || std::any_of(choices.begin(), choices.end(), [&](const auto& choice) {
           const auto number = NumberOf(choice);
           return number && std::abs(number->value - value) < kSame;
         });
}

bool ScannerOption::Takes(std::string_view value) const {
  if (const auto number = NumberOf(value); range && number) return Takes(number->value);
  return choices.empty() || std::find(choices.begin(), choices.end(), value) != choices.end();
}

std::string ScannerOption::Values() const {
  if (range) return fmt::format("{:g} to {:g}", range->first, range->second);
  return fmt::format("{}", fmt::join(choices, ", "));
}

void ScannerOptions::Add(std::string_view line) {
  const std::size_t begin = line.find_first_not_of(' ');
  if (begin == std::string_view::npos || line[begin] != '-') return;
  if (options_.size() == kMaxOptions) return;
  line.remove_prefix(begin);
  line.remove_prefix(std::min(line.find_first_not_of('-'), line.size()));
  ScannerOption option;
  option.name = line.substr(0, line.find_first_of(" [="));
  if (option.name.empty()) return;
  line.remove_prefix(option.name.size());
  option.active = line.find("[inactive]") == std::string_view::npos;
  constexpr std::string_view kFlag = "[=(";  // boolean option
  if (line.starts_with(kFlag)) {
    TakeValues(Before(line.substr(kFlag.size()), ")"), option);
  } else {
    std::string_view values = line.substr(std::min(line.find_first_not_of(' '), line.size()));
    if (!values.starts_with('[')) TakeValues(Before(Before(values, " ["), " (in steps"), option);
  }
  options_.push_back(std::move(option));
}

const ScannerOption* ScannerOptions::Find(std::string_view name) const {
  const auto found = std::find_if(options_.begin(), options_.end(),
                                  [&](const ScannerOption& option) { return option.name == name; });
  return found == options_.end() ? nullptr : &*found;
}

const ScannerOption* ScannerOptions::FindActive(std::string_view name) const {
  const ScannerOption* option = Find(name);
  return option != nullptr && option->active ? option : nullptr;
}

namespace {

using Arguments = std::vector<std::string>;

constexpr double kInch_mm = 25.4;

/// SANE's text of a status, and the remedy.
struct Advice {
  std::string_view said;
  std::string_view remedy;
};

constexpr std::array kAdvice = {
    Advice{"Device busy", "another program uses it: close that, or wait"},
    Advice{"feeder jammed", "paper is jammed: open it, take the paper out, and scan again"},
    Advice{"cover is open", "its cover is open: close it, and scan again"},
    Advice{"out of documents",
           "its feeder is empty: lay the sheet on the glass, with --option source=Flatbed"},
    Advice{"access to resource has been denied",
           "this user may not use it: add the user to the group 'scanner', and log in again"},
    Advice{"during device I/O",
           "the connection broke: look at cable, network and power, and scan again"},
    Advice{"Out of memory", "there is not enough memory: scan a smaller area or with fewer dpi"},
    Advice{"Invalid argument",
           "it does not know this: see trammel offset scan --list, and scanimage --help -d NAME"}};

std::string_view RemedyFor(const std::string& said) {
  for (const Advice& advice : kAdvice) {
    if (LowerCase(said).find(LowerCase(advice.said)) != std::string::npos) return advice.remedy;
  }
  return "switch it off and on, and scan again";
}

/// One run of scanimage.
struct Run {
  std::string about;  ///< whom, for messages
  std::stop_token stop;
  std::uint64_t max_bytes = 1 << 20;  ///< per output file
  std::function<void(std::string_view)> take_line = {};
  std::function<void(double)> progress = {};
};

/// Parses scanimage's progress: "Progress: 12.3%".
bool TakeProgress(std::string_view line, const Run& run) {
  constexpr std::string_view kProgress = "Progress: ";
  if (!line.starts_with(kProgress)) return false;
  double percent = 0;
  const auto read =
      std::from_chars(line.data() + kProgress.size(), line.data() + line.size(), percent);
  if (read.ec == std::errc() && run.progress) run.progress(std::clamp(percent / 100, 0.0, 1.0));
  return true;
}

Result<void> ScanImage(const ScanRequest& request, const Arguments& more, const Run& run) {
  if (access(request.program.c_str(), X_OK) != 0) {
    return Fail(fmt::format("there is no {}, which scans; install it: apt install sane-utils "
                            "(sane-airscan for network scanners)",
                            request.program),
                ErrorKind::kMachine);
  }
  Arguments words = {"/usr/bin/env", "LC_ALL=C", request.program};
  words.insert(words.end(), more.begin(), more.end());
  auto process = TRY(CommandProcess::Start(words, run.max_bytes));
  std::string said;  // its last output
  const CommandEnd end = process->Follow(
      [&](OutputStream stream, std::string_view line) {
        constexpr std::size_t kLongest = 300;
        if (stream == OutputStream::kOutput && run.take_line) run.take_line(line);
        if (stream == OutputStream::kOutput || TakeProgress(line, run)) return;
        constexpr std::string_view kName = "scanimage: ";
        if (line.starts_with(kName)) line.remove_prefix(kName.size());
        // Messages of a driver's own process, which ends after the relevant message.
        if (line.empty() || line.starts_with("received signal") ||
            line.starts_with("trying to stop scanner")) {
          return;
        }
        said = Utf8OrReplaced(line, kLongest);
      },
      {run.stop, request.silence_s, request.rest_s});
  constexpr const char* kAnotherWay =
      "see whether scanimage -d NAME can do it, update the driver, or scan to a file with another "
      "program: analyze reads that";
  if (end.cause == CommandEnd::Cause::kStop) {
    return Fail("stopped during the scan", ErrorKind::kInterrupted);
  }
  if (end.cause == CommandEnd::Cause::kSilence) {
    return Fail(fmt::format("{} said nothing for {:g} s: switch it off and on, and try again; "
                            "otherwise {}",
                            run.about, request.silence_s, kAnotherWay),
                ErrorKind::kMachine);
  }
  if (end.signal == SIGXFSZ) {
    return Fail(
        fmt::format("{}: the page became larger than the limit of megapixels; scan only "
                    "the sheet, or with fewer dpi",
                    run.about));
  }
  if (end.signal != 0) {
    return Fail(
        fmt::format("{}: its driver crashed ({}): {}", run.about, end.Describe(), kAnotherWay),
        ErrorKind::kMachine);
  }
  if (end.exit_code == 0) return {};
  return Fail(
      fmt::format("{}: {} ({})", run.about, RemedyFor(said), said.empty() ? end.Describe() : said),
      ErrorKind::kMachine);
}

Result<std::string> ChooseDevice(const ScanRequest& request) {
  if (!request.device.empty()) return request.device;
  const auto scanners = TRY(ListScanners(request));
  if (scanners.size() == 1) return scanners.front().name;
  if (scanners.empty()) {
    return Fail(
        "no scanner was found: switch it on, look at cable or network, and whether "
        "scanimage -L finds it",
        ErrorKind::kMachine);
  }
  std::string names;
  for (const ScannerInfo& scanner : scanners) names += fmt::format("\n  {}", scanner.name);
  return Fail(fmt::format("there are several scanners; name one of them with --device:{}", names));
}

/// Returns the scanner's own name of grey or colour; empty if it has no choice.
Result<std::string> ModeOf(const ScannerOptions& options, bool color) {
  const ScannerOption* option = options.FindActive("mode");
  if (option == nullptr || option->choices.empty()) return std::string();
  for (const std::string& choice : option->choices) {
    const std::string name = LowerCase(choice);
    const bool is_color = name.find("color") != std::string::npos;
    const bool is_grey =
        name.find("gray") != std::string::npos || name.find("grey") != std::string::npos;
    if (color ? is_color : is_grey && !is_color) return choice;
  }
  return Fail(fmt::format("the scanner has no {} mode; leave --color {}", color ? "colour" : "grey",
                          color ? "away" : "on"));
}

/// Adds the area to the words. @returns its size; absent if the scanner does not state it.
Result<std::optional<ScanArea>> AddArea(const ScannerOptions& options,
                                        const std::optional<ScanArea>& wanted, Arguments& words) {
  ScanArea area = wanted.value_or(ScanArea{});
  struct Side {
    const char* name;
    double* mm;
    bool far;
  };
  bool whole = true;
  for (const Side& side : {Side{"l", &area.x_mm, false}, Side{"t", &area.y_mm, false},
                           Side{"x", &area.width_mm, true}, Side{"y", &area.height_mm, true}}) {
    const ScannerOption* option = options.FindActive(side.name);
    if (option == nullptr) {
      if (wanted) return Fail("the scanner lets no area be chosen: leave it away");
      whole = false;
      continue;
    }
    if (!wanted && !option->range) {
      whole = false;
      continue;
    }
    if (!wanted) *side.mm = side.far ? option->range->second : 0;
    if (wanted && !option->Takes(*side.mm)) {
      return Fail(fmt::format("the scanner has no {} of {:g} mm; it has {}",
                              side.far ? "length" : "place", *side.mm, option->Values()));
    }
    words.insert(words.end(), {fmt::format("-{}", side.name), fmt::format("{:g}", *side.mm)});
  }
  return whole ? std::optional(area) : std::nullopt;
}

Result<void> AddOwnOptions(const ScannerOptions& options, const ScanRequest& request,
                           Arguments& words) {
  for (const auto& [name, value] : request.options) {
    const ScannerOption* option = options.Find(name);
    if (option == nullptr || name.size() < 2) {
      return Fail(fmt::format("the scanner has no option '{}' to set", name));
    }
    if (!option->Takes(std::string_view(value))) {
      return Fail(
          fmt::format("the scanner has no {} '{}'; it has {}", name, value, option->Values()));
    }
    words.push_back(fmt::format("--{}={}", name, value));
  }
  return {};
}

Result<void> AddSettings(const ScannerOptions& options, const ScanRequest& request,
                         const PageReadOptions& limits, Arguments& words) {
  if (const auto* source = options.FindActive("source");
      source != nullptr && source->Takes(std::string_view("Flatbed"))) {
    words.push_back("--source=Flatbed");
  }
  const auto mode = TRY(ModeOf(options, request.color));
  if (!mode.empty()) words.push_back("--mode=" + mode);
  constexpr double kBits = 8;
  if (const auto* depth = options.FindActive("depth"); depth != nullptr && depth->Takes(kBits)) {
    words.push_back("--depth=8");
  }
  const ScannerOption* resolution = options.FindActive("resolution");
  if (resolution == nullptr) {
    return Fail("the scanner does not let its resolution be chosen", ErrorKind::kMachine);
  }
  if (!resolution->Takes(request.dpi)) {
    return Fail(fmt::format("the scanner has no resolution of {:g}; it has {}", request.dpi,
                            resolution->Values()));
  }
  for (const char* name : {"resolution", "y-resolution"}) {
    if (options.FindActive(name) != nullptr) {
      words.push_back(fmt::format("--{}={:g}", name, request.dpi));
    }
  }
  const auto area = TRY(AddArea(options, request.area, words));
  const double pixels =
      area ? area->width_mm * area->height_mm / (kInch_mm * kInch_mm) * request.dpi * request.dpi
           : 0;
  if (pixels > static_cast<double>(limits.most_pixels)) {
    return Fail(
        fmt::format("the page would have {:.0f} megapixels, and at most {} megapixels are "
                    "scanned; scan only the sheet, or with fewer dpi, or raise the limit",
                    pixels / 1e6, limits.most_pixels / 1'000'000));
  }
  return AddOwnOptions(options, request, words);
}

/// Errors: the page's stated resolution differs from the requested one.
Result<Page> ReadBack(const std::filesystem::path& path, double dpi,
                      const PageReadOptions& limits) {
  auto pages = ReadPages(path, limits);
  if (!pages) {
    return Fail("what scanimage wrote cannot be read back: " + pages.error().message,
                ErrorKind::kMachine);
  }
  Page page = std::move(pages->front());
  constexpr double kSame = 0.01;
  const auto is_same = [&](const std::optional<double>& stated) {
    return stated && std::abs(*stated - dpi) <= kSame * dpi;
  };
  if (is_same(page.dpi_x) && is_same(page.dpi_y)) return page;
  return Fail(fmt::format("the scanner took {:g} dpi where {:g} were asked for: ask for another "
                          "resolution with --dpi",
                          page.dpi_x.value_or(0), dpi),
              ErrorKind::kMachine);
}

/// Replaces the file's content by the page.
Result<void> WriteAsPng(const Page& page, const files::NewFile& file) {
  if (ftruncate(file.fd(), 0) != 0) return Fail("the page cannot be written anew; check the disk");
  image::PngForm form;
  form.width_px = page.width;
  form.height_px = page.height;
  form.channels = page.channels;
  form.packing = image::PngForm::Packing::kDense;
  form.dpi_x = page.dpi_x;
  form.dpi_y = page.dpi_y;
  auto png = image::PngWriter::Create(form, [&file](std::span<const std::uint8_t> bytes) {
    return file.Write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  });
  if (!png) return tl::unexpected(png.error());
  for (int y = 0; y < page.height; ++y) TRY(png->WriteRow(page.view().row(y)));
  return png->Finish();
}

}  // namespace

Result<std::vector<ScannerInfo>> ListScanners(const ScanRequest& request) {
  std::vector<ScannerInfo> scanners;
  Run run{.about = "looking for scanners", .stop = {}};
  run.take_line = [&](std::string_view line) {
    constexpr std::size_t kLongest = 200;
    std::array<std::string, 4> parts;
    for (std::string& part : parts) {
      const std::size_t end = std::min(line.find('\t'), line.size());
      part = Utf8OrReplaced(line.substr(0, end), kLongest);
      line.remove_prefix(std::min(end + 1, line.size()));
    }
    if (!parts[1].empty()) scanners.push_back({parts[0], parts[1], parts[2], parts[3]});
  };
  TRY(ScanImage(request, {"-f", "%d\t%v\t%m\t%t%n"}, run));
  return scanners;
}

Result<void> CheckPagePath(const std::filesystem::path& path) {
  const std::string ending = path.extension().string();
  if (ending != ".png" && ending != ".tif" && ending != ".tiff") {
    return Fail(fmt::format("page {}: its name must end in .png, .tif or .tiff", path.string()));
  }
  auto free = files::CheckTarget(path, files::IfThere::kRefuse, "give another name");
  return free ? free : Fail("page " + free.error().message);
}

Result<Page> ScanPage(const ScanRequest& request, const std::filesystem::path& to,
                      const PageReadOptions& limits, const std::function<void(double)>& progress,
                      const std::stop_token& stop) {
  const auto device = TRY(ChooseDevice(request));
  Run run{.about = fmt::format("scanner {}", device), .stop = stop};
  ScannerOptions options;
  run.take_line = [&](std::string_view line) { options.Add(line); };
  const Arguments named = {fmt::format("--device-name={}", device)};
  Arguments words = named;
  words.push_back("-A");
  TRY(ScanImage(request, words, run));
  auto file = files::NewFile::Create(to, files::IfThere::kRefuse);
  if (!file) return Fail("page " + file.error().message);
  words = named;
  // Debian 12's scanimage crashes on a PNG if the scanner does not know the page's length in
  // advance.
  words.insert(words.end(), {"--format=tiff", "--progress",
                             fmt::format("--output-file={}", file->temporary_path().string())});
  TRY(AddSettings(options, request, limits, words));
  run.take_line = {};
  run.progress = progress;
  constexpr std::uint64_t kHeads = 1 << 20;  // headers of file and rows
  run.max_bytes = 3 * static_cast<std::uint64_t>(limits.most_pixels) + kHeads;
  TRY(ScanImage(request, words, run));
  auto page = ReadBack(file->temporary_path(), request.dpi, limits);
  if (!page) return page;
  Result<void> kept;
  if (to.extension() == ".png") kept = WriteAsPng(*page, *file);
  if (kept) kept = file->Commit();
  if (!kept) return tl::unexpected(kept.error());
  return page;
}

}  // namespace trammel::machine
