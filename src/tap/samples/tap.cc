#include "tap/samples/tap.h"

namespace trammel::tap {

std::string_view ToString(Method method) {
  switch (method) {
    case Method::kContact:
      return "contact";
    case Method::kTwoLine:
      return "two-line";
  }
  return "contact";
}

}  // namespace trammel::tap
