#include "machine/scanner/sane_device.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

namespace trammel::machine {
namespace {

std::string_view WhatToDo(SANE_Status status) {
  switch (status) {
    case SANE_STATUS_DEVICE_BUSY:
      return "another program uses it: close that, or wait";
    case SANE_STATUS_JAMMED:
      return "paper is jammed: open it, take the paper out, and scan again";
    case SANE_STATUS_COVER_OPEN:
      return "its cover is open: close it, and scan again";
    case SANE_STATUS_NO_DOCS:
      return "its feeder is empty: lay the sheet on the glass, with --option source=Flatbed";
    case SANE_STATUS_ACCESS_DENIED:
      return "this user may not use it: add the user to the group 'scanner', and log in again";
    case SANE_STATUS_IO_ERROR:
      return "the connection broke: look at cable, network and power, and scan again";
    case SANE_STATUS_NO_MEM:
      return "there is not enough memory: scan a smaller area or with fewer dpi";
    case SANE_STATUS_INVAL:
      return "it does not know this: see trammel offset scan --list, and scanimage --help -d NAME";
    default:
      return "switch it off and on, and scan again";
  }
}

double NumberOf(const SANE_Option_Descriptor& descriptor, SANE_Word word) {
  return descriptor.type == SANE_TYPE_FIXED ? SANE_UNFIX(word) : word;
}

// The values of a list or a range as a user reads them; empty where any will do.
std::string Allowed(const SANE_Option_Descriptor& descriptor) {
  if (descriptor.constraint_type == SANE_CONSTRAINT_RANGE) {
    const SANE_Range& range = *descriptor.constraint.range;
    return fmt::format("{} to {}", NumberOf(descriptor, range.min),
                       NumberOf(descriptor, range.max));
  }
  std::vector<double> values;
  if (descriptor.constraint_type == SANE_CONSTRAINT_WORD_LIST) {
    const SANE_Word* list = descriptor.constraint.word_list;
    for (SANE_Word i = 1; i <= list[0]; ++i) values.push_back(NumberOf(descriptor, list[i]));
  }
  return fmt::format("{}", fmt::join(values, ", "));
}

bool IsAllowed(const SANE_Option_Descriptor& descriptor, double value) {
  if (descriptor.constraint_type == SANE_CONSTRAINT_RANGE) {
    const SANE_Range& range = *descriptor.constraint.range;
    return value >= NumberOf(descriptor, range.min) && value <= NumberOf(descriptor, range.max);
  }
  if (descriptor.constraint_type == SANE_CONSTRAINT_WORD_LIST) {
    const SANE_Word* list = descriptor.constraint.word_list;
    return std::any_of(list + 1, list + 1 + list[0], [&](SANE_Word word) {
      return std::abs(NumberOf(descriptor, word) - value) < 1e-3;
    });
  }
  return true;
}

}  // namespace

Error SaneError(std::string_view tried, SANE_Status status) {
  return {status == SANE_STATUS_CANCELLED ? ErrorKind::kInterrupted : ErrorKind::kMachine,
          fmt::format("{}: {} ({})", tried, WhatToDo(status), sane_strstatus(status))};
}

Result<void> StartSane() {
  const SANE_Status status = sane_init(nullptr, nullptr);
  if (status != SANE_STATUS_GOOD) return tl::unexpected(SaneError("starting SANE", status));
  return {};
}

Result<std::span<const SANE_Device* const>> SaneDevices() {
  const SANE_Device** devices = nullptr;
  const SANE_Status status = sane_get_devices(&devices, SANE_FALSE);
  if (status != SANE_STATUS_GOOD) return tl::unexpected(SaneError("looking for scanners", status));
  std::size_t count = 0;
  while (devices != nullptr && devices[count] != nullptr) ++count;
  return std::span<const SANE_Device* const>(devices, count);
}

Result<SaneDevice> SaneDevice::Open(const std::string& name) {
  SANE_Handle handle = nullptr;
  const SANE_Status status = sane_open(name.c_str(), &handle);
  if (status != SANE_STATUS_GOOD) {
    return tl::unexpected(SaneError(fmt::format("opening scanner {}", name), status));
  }
  return SaneDevice(handle);
}

SaneDevice::~SaneDevice() {
  if (handle_ != nullptr) {
    sane_cancel(handle_);
    sane_close(handle_);
  }
}

std::optional<SaneDevice::Option> SaneDevice::Find(std::string_view name) const {
  SANE_Int count = 0;
  if (sane_control_option(handle_, 0, SANE_ACTION_GET_VALUE, &count, nullptr) != SANE_STATUS_GOOD) {
    return std::nullopt;
  }
  for (SANE_Int i = 1; i < count; ++i) {
    const SANE_Option_Descriptor* descriptor = sane_get_option_descriptor(handle_, i);
    if (descriptor != nullptr && descriptor->name != nullptr && name == descriptor->name &&
        SANE_OPTION_IS_ACTIVE(descriptor->cap) && SANE_OPTION_IS_SETTABLE(descriptor->cap)) {
      return Option{i, descriptor};
    }
  }
  return std::nullopt;
}

Result<void> SaneDevice::Control(const Option& option, void* value) const {
  SANE_Int info = 0;
  const SANE_Status status =
      sane_control_option(handle_, option.index, SANE_ACTION_SET_VALUE, value, &info);
  if (status == SANE_STATUS_GOOD) return {};
  return tl::unexpected(
      SaneError(fmt::format("setting the scanner's {}", option.descriptor->name), status));
}

Result<double> SaneDevice::SetNumber(const Option& option, double value) const {
  const SANE_Option_Descriptor& descriptor = *option.descriptor;
  if (!IsAllowed(descriptor, value)) {
    return Fail(fmt::format("the scanner has no {} of {}; it has {}", descriptor.name, value,
                            Allowed(descriptor)));
  }
  SANE_Word word = descriptor.type == SANE_TYPE_FIXED ? SANE_FIX(value)
                                                      : static_cast<SANE_Word>(std::lround(value));
  if (auto set = Control(option, &word); !set) return tl::unexpected(set.error());
  // The scanner may have taken another one.
  const SANE_Status status =
      sane_control_option(handle_, option.index, SANE_ACTION_GET_VALUE, &word, nullptr);
  return status == SANE_STATUS_GOOD ? NumberOf(descriptor, word) : value;
}

Result<void> SaneDevice::SetText(const Option& option, const std::string& value) const {
  const SANE_Option_Descriptor& descriptor = *option.descriptor;
  const std::vector<std::string> choices = Choices(option);
  if (!choices.empty() && std::find(choices.begin(), choices.end(), value) == choices.end()) {
    return Fail(fmt::format("the scanner has no {} '{}'; it has {}", descriptor.name, value,
                            fmt::join(choices, ", ")));
  }
  std::vector<char> text(std::max<std::size_t>(static_cast<std::size_t>(descriptor.size), 1), '\0');
  if (value.size() >= text.size()) {
    return Fail(fmt::format("the scanner's {} takes at most {} characters, not '{}'",
                            descriptor.name, text.size() - 1, value));
  }
  std::copy(value.begin(), value.end(), text.begin());
  return Control(option, text.data());
}

Result<void> SaneDevice::SetFromText(const Option& option, const std::string& value) const {
  const SANE_Option_Descriptor& descriptor = *option.descriptor;
  if (descriptor.type == SANE_TYPE_STRING) return SetText(option, value);
  if (descriptor.type == SANE_TYPE_BOOL && (value == "yes" || value == "no")) {
    SANE_Word word = value == "yes" ? SANE_TRUE : SANE_FALSE;
    return Control(option, &word);
  }
  double number = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  const bool whole = error == std::errc() && end == value.data() + value.size();
  const bool one_number =
      (descriptor.type == SANE_TYPE_INT || descriptor.type == SANE_TYPE_FIXED) &&
      descriptor.size == sizeof(SANE_Word);
  if (!whole || !one_number) {
    return Fail(fmt::format("'{}' is no value for the scanner's {}; it takes {}", value,
                            descriptor.name,
                            descriptor.type == SANE_TYPE_BOOL ? "yes or no" : "one number"));
  }
  auto set = SetNumber(option, number);
  if (!set) return tl::unexpected(set.error());
  return {};
}

std::vector<std::string> SaneDevice::Choices(const Option& option) {
  std::vector<std::string> choices;
  if (option.descriptor->constraint_type == SANE_CONSTRAINT_STRING_LIST) {
    for (const SANE_String_Const* text = option.descriptor->constraint.string_list;
         *text != nullptr; ++text) {
      choices.emplace_back(*text);
    }
  }
  return choices;
}

std::optional<double> SaneDevice::Largest(const Option& option) {
  const SANE_Option_Descriptor& descriptor = *option.descriptor;
  if (descriptor.constraint_type != SANE_CONSTRAINT_RANGE) return std::nullopt;
  return NumberOf(descriptor, descriptor.constraint.range->max);
}

}  // namespace trammel::machine
