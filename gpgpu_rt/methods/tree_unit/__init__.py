"""One tree traversal for kd-trees and BVHs, with an exchangeable criterion (survey, section 5)."""
