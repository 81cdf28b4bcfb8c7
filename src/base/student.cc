#include "base/student.h"

#include <boost/math/special_functions/beta.hpp>
#include <cmath>

#include "base/check.h"

namespace trammel {

double StudentPoint(double probability, double freedom) {
  TRAMMEL_CHECK(probability > 0 && probability < 1 && freedom > 0, "probability = {}, freedom = {}",
                probability, freedom);
  const double share = boost::math::ibeta_inv(0.5 * freedom, 0.5, probability);
  return std::sqrt(freedom * (1 - share) / share);
}

}  // namespace trammel
