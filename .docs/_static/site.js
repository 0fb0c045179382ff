// the buttons of sphinx-copybutton have no name for screen readers
addEventListener("load", () => {
  for (const button of document.querySelectorAll(".copybtn")) button.ariaLabel = "Copy";
});
