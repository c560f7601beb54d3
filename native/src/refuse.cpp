#include "refuse.hpp"

#include <stdexcept>

namespace racecraft {

void refuse(const std::string& message) {
    throw std::invalid_argument(message);
}

}  // namespace racecraft
