"""Evidence about a launch for those who must sign for a product: what was decided, checked, and not checked.

It claims no conformity: whether a requirement is met is for the manufacturer, who knows the product, to say.
"""
