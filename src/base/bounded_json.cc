#include "base/bounded_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/file_kind.h"

namespace trammel {
namespace {

using nlohmann::json;

constexpr std::size_t kShownKey = 60;

// Maximum bytes of a value while it is built, by kind, on a 64-bit host: lists grow by doubling and
// temporarily hold both copies; members are nodes of a tree.
constexpr std::size_t kSlot = 3 * sizeof(json);
constexpr std::size_t kContainer = 64;
constexpr std::size_t kMember = 48 + sizeof(std::string) + sizeof(json);
constexpr std::size_t kText = sizeof(std::string) + 16;

std::string Shown(const std::string& key) {
  const std::string text = json(key).dump(-1, ' ', true, json::error_handler_t::replace);
  if (text.size() <= kShownKey) return text;
  return fmt::format("{}...", text.substr(0, kShownKey - 3));
}

/// Builds the value from the parser's events; an event that returns false ends the parsing.
class Builder {
 public:
  explicit Builder(const JsonBounds& bounds) : bounds_(bounds) {}

  bool null() { return Put(nullptr, 0) != nullptr; }
  bool boolean(bool value) { return Put(value, 0) != nullptr; }
  bool number_integer(std::int64_t value) { return Put(value, 0) != nullptr; }
  bool number_unsigned(std::uint64_t value) { return Put(value, 0) != nullptr; }
  bool number_float(double value, const std::string& /*text*/) { return Put(value, 0) != nullptr; }
  bool string(std::string& value) {
    if (!IsSound(value)) return false;
    const std::size_t bytes = kText + value.size();
    return Put(std::move(value), bytes) != nullptr;
  }
  bool binary(json::binary_t& /*value*/) { return false; }  // there is none in text
  bool start_object(std::size_t /*size*/) { return Open(json::object()); }
  bool start_array(std::size_t /*size*/) { return Open(json::array()); }
  bool end_object() { return Close(); }
  bool end_array() { return Close(); }

  bool key(std::string& name) {
    if (!Spend(kMember + name.size()) || !IsSound(name)) return false;
    if (bounds_.unique_keys && open_.back()->contains(name)) {
      fault_ = fmt::format("the key {} is given twice", Shown(name));
      return false;
    }
    member_ = &(*open_.back())[std::move(name)];
    return true;
  }

  bool parse_error(std::size_t byte, const std::string& /*token*/, const json::exception& error) {
    // Removes the library's prefix in brackets, which does not help a user.
    const std::string_view what = error.what();
    const std::size_t bracket = what.find("] ");
    no_json_ = what.substr(bracket == std::string_view::npos ? 0 : bracket + 2);
    no_json_byte_ = byte;
    return false;
  }

  json root;

  [[nodiscard]] const std::string& fault() const { return fault_; }
  [[nodiscard]] const std::string& no_json() const { return no_json_; }
  [[nodiscard]] std::size_t no_json_byte() const { return no_json_byte_; }

 private:
  bool IsSound(const std::string& text) {
    if (bounds_.zeros || text.find('\0') == std::string::npos) return true;
    fault_ = fmt::format("{} holds the character U+0000: take it out", Shown(text));
    return false;
  }

  bool Spend(std::size_t bytes) {
    spent_ += bytes;
    if (spent_ <= bounds_.max_memory_bytes) return true;
    fault_ = fmt::format("its values would take more than the {} MB of memory that are allowed",
                         bounds_.max_memory_bytes >> 20);
    return false;
  }

  json* Put(json value, std::size_t bytes) {
    if (!Spend(kSlot + bytes)) return nullptr;
    if (open_.empty()) {
      root = std::move(value);
      return &root;
    }
    if (open_.back()->is_array()) {
      open_.back()->push_back(std::move(value));
      return &open_.back()->back();
    }
    *member_ = std::move(value);
    return member_;
  }

  bool Open(json container) {
    if (static_cast<int>(open_.size()) >= bounds_.max_levels) {
      fault_ = fmt::format("objects and lists are nested more than {} deep", bounds_.max_levels);
      return false;
    }
    json* const placed = Put(std::move(container), kContainer);
    if (placed == nullptr) return false;
    open_.push_back(placed);
    return true;
  }

  bool Close() {
    open_.pop_back();
    return true;
  }

  const JsonBounds bounds_;
  std::vector<json*> open_;  ///< root first; no list grows while an element of it is open
  json* member_ = nullptr;   ///< value of the last key
  std::size_t spent_ = 0;
  std::string fault_;
  std::string no_json_;
  std::size_t no_json_byte_ = 0;
};

}  // namespace

Result<json> ParseBoundedJson(std::string_view text, const std::string& name,
                              const JsonBounds& bounds) {
  if (text.size() > bounds.max_bytes) {
    return Fail(fmt::format("{}: is {} bytes of JSON; at most {} are read", name, text.size(),
                            bounds.max_bytes));
  }
  const auto line_of = [&text](std::size_t byte) {
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(text.size(), byte));
    return 1 + std::count(text.begin(), end, '\n');
  };
  // The parser treats a zero byte as the end of the text.
  if (const std::size_t zero = text.find('\0'); zero != std::string_view::npos) {
    if (const auto kind = KindByContent(text)) {
      return Fail(fmt::format("{}: is {}, not JSON: {}", name, kind->name, kind->remedy));
    }
    return Fail(
        fmt::format("{}:{}: is not JSON: it holds a byte of zero; save it as UTF-8, or copy "
                    "it again",
                    name, line_of(zero)));
  }
  Builder builder(bounds);
  const bool whole = json::sax_parse(text, &builder);
  if (!builder.fault().empty()) return Fail(fmt::format("{}: {}", name, builder.fault()));
  if (!whole) {
    if (const auto kind = KindByContent(text)) {
      return Fail(fmt::format("{}: is {}, not JSON: {}", name, kind->name, kind->remedy));
    }
    return Fail(fmt::format("{}:{}: is not JSON: {}", name, line_of(builder.no_json_byte()),
                            builder.no_json()));
  }
  return std::move(builder.root);
}

}  // namespace trammel
