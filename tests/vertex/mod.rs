mod adaptive;
