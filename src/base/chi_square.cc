#include "base/chi_square.h"

#include <boost/math/special_functions/gamma.hpp>

#include "base/check.h"

namespace trammel {

double ChiSquareTail(double value, int freedom) {
  if (freedom < 1 || !(value > 0)) return 1;
  return boost::math::gamma_q(0.5 * freedom, 0.5 * value);
}

double ChiSquareQuantile(double probability, int freedom) {
  TRAMMEL_CHECK(probability > 0 && probability < 1 && freedom > 0, "probability = {}, freedom = {}",
                probability, freedom);
  return 2 * boost::math::gamma_p_inv(0.5 * freedom, probability);
}

}  // namespace trammel
