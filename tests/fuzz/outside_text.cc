// Text that comes from peers and people, as it is cleaned, shown and judged.
#include <nlohmann/json.hpp>
#include <string>

#include "base/url_secrets.h"
#include "base/utf8.h"
#include "fuzz.h"
#include "sim/camera/own_host.h"

TRAMMEL_FUZZ_TARGET(outside_text)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  const std::string_view text = fuzz::Text(data, size);
  const std::string clean = Utf8OrReplaced(text);
  (void)nlohmann::json(clean).dump();  // throws where it is not UTF-8
  fuzz::Require(Utf8OrReplaced(clean) == clean, "what is clean stays as it is");
  constexpr std::size_t kMost = 40;
  constexpr std::size_t kEllipsis = 3;
  const std::string cut = Utf8OrReplaced(text, kMost);
  (void)nlohmann::json(cut).dump();
  fuzz::Require(cut.size() <= kMost + kEllipsis, "what is cut is short");
  const std::string shown = EscapedForTerminal(text);
  (void)nlohmann::json(shown).dump();
  for (const char c : shown) {
    const auto byte = static_cast<unsigned char>(c);
    fuzz::Require(byte >= 0x20 ? byte != 0x7F : c == '\n' || c == '\t',
                  "a terminal gets no control character");
  }
  fuzz::Require(IncompleteUtf8(text) <= 3, "at most three bytes begin a character");
  const std::string told = WithoutSecrets(text);
  fuzz::Require(WithoutSecrets(told) == told, "what holds no secret any more stays as it is");
  (void)sim::IsOwnHost(text);
  (void)sim::IsOwnOrigin(text);
  return 0;
}
