"""The boundary equations of collocation solved by iteration, with products by the fast multipole method."""
