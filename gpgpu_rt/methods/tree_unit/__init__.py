"""One traversal for kd-trees and BVHs. An option sets how a ray chooses a node's children."""
