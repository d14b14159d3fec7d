"""One traversal for kd-trees and BVHs; an option says how a ray chooses a node's children."""
