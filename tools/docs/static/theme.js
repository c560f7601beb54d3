// Light or dark as it was chosen here or on the page of the cars, before anything is drawn.
document.addEventListener("DOMContentLoaded", () => {
  const chosen = localStorage.getItem("theme") ?? localStorage.getItem("racecraft-theme");
  document.body.dataset.theme = ["light", "dark"].includes(chosen) ? chosen : "auto";
});
